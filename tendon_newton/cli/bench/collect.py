"""Record what a servo and its tendon do, on a real bench or a virtual one, as a dataset.

A minute of steps on a virtual finger, in real time:
  tendon-newton collect --port virtual --bench finger --excitation random_steps --out runs

The same on a bench that is plugged in:
  tendon-newton collect --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0 --calibration cell.toml
  --bench finger --excitation random_steps --out runs

The paper's 36 minutes on the virtual benches, in a few minutes:
  tendon-newton collect --plan paper --port virtual --seed 0 --faster-than-real-time --out dataset

Ctrl-C ends a run in an orderly way: the motor is off and the file is closed. The same command takes
a plan up again: finished recordings are kept, an interrupted one is made anew.
"""

from tendon_newton.cli.terminal import Terminal
from tendon_newton.workflows.options import CollectOptions


def main(config: CollectOptions) -> None:
    """Record, say what came of it and what is left; what went wrong ends the verb."""
    from tendon_newton.workflows.collection import record

    with Terminal() as operator:
        collection = record(config, operator)
    for outcome in collection.outcomes:
        gaps = sum(end - start for start, end in outcome.gaps)
        state = "" if outcome.finished else "   NOT FINISHED, not listed"
        print(
            f"  {outcome.path.name:44s} {outcome.rows:6d} rows, {outcome.missed} missed, "
            f"{gaps:.2f} s of gaps, {outcome.readings} forces{state}"
        )
    late = [outcome.pacing for outcome in collection.outcomes]
    if late:
        print(f"\npacing of the last run: {late[-1].text}")
    print(
        f"{config.out}: {len(collection.outcomes)} recorded now, {collection.kept} before, "
        f"{collection.left} left"
    )
    last = collection.outcomes[-1] if collection.outcomes else None
    if last is not None and last.fault is not None:
        raise last.fault
    if last is not None and last.interrupted is not None:
        raise KeyboardInterrupt
