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

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Literal, Self

if TYPE_CHECKING:
    from hardware.collection.collect_plan import Collection
    from hardware.collection.excitation_plan import PlannedRun
    from hardware.control.operator import Progress


@dataclass(frozen=True, kw_only=True)
class CollectConfig:
    """What to record, where the bench is, and where the dataset goes."""

    out: Path
    """Folder of the dataset; recordings are added to it."""
    port: str
    """Serial port of the servo, or virtual, or virtual::3 for unit 3 of the virtual benches."""
    plan: str | None = None
    """Plan to record: paper (36 min) or quick (1 min); without one, a single run."""
    bench: str = "finger"
    """Bench of a single run: finger, spring_weak or spring_strong."""
    excitation: str = "random_steps"
    """Command of a single run, such as random_steps, sine, ramps or steps_held_2s."""
    duration: float = 60.0
    """Length of a single run [s]."""
    split: Literal["train", "test"] = "train"
    """Split of a single run."""
    obstacle: str = "free"
    """What blocks the finger in a single run: free, tape_roll, hand or hand_perturbation."""
    load_cell_port: str | None = None
    """Serial port of the load cell; a virtual bench brings its own."""
    load_cell: str = "hx711_serial"
    """Kind of the load cell."""
    calibration: Path | None = None
    """Calibration of the load cell; without one only raw counts are kept."""
    servo: str = "xc330_t288_t"
    """Kind of the servo."""
    servo_id: int = 1
    """ID of the servo on its bus."""
    baud: int = 1_000_000
    """Rate of the bus [1/s]."""
    retries: int | None = None
    """How often an instruction to the servo is sent again, 4 ms each; 2 unless given."""
    rate: float = 80.0
    """Readings of the servo per second [Hz]."""
    command_rate: float | None = None
    """Commands per second [Hz]; 20 unless given."""
    force_limit: float = 30.0
    """Tension at which the motor is switched off [N]."""
    temperature_limit: float = 65.0
    """Temperature at which the motor is switched off [degC]."""
    seed: int = 0
    """Of what the excitations draw."""
    virtual_load_cell_rate: int = 20
    """Readings per second of a virtual load cell: 20 as on the paper's bench, 80 or 10 [Hz]."""
    faster_than_real_time: bool = False
    """Whether a virtual bench runs as fast as it can."""
    notes: str = ""
    """What is to be remembered with the recordings."""


def main(config: CollectConfig) -> None:
    """Record, and say what came of it."""
    from hardware.benches.bench_address import BenchAddress
    from hardware.collection.collect_plan import SINGLE_RUNS, collect
    from hardware.collection.collect_settings import CollectSettings
    from hardware.safety_rules.limits import SafetyLimits
    from hardware.stop_request import StopRequest

    plan = planned(config)
    address = BenchAddress(
        bench=plan[0].bench,
        port=config.port,
        load_cell_port=config.load_cell_port,
        load_cell=config.load_cell,
        calibration=config.calibration,
        servo=config.servo,
        identifier=config.servo_id,
        baud=config.baud,
        retries=config.retries,
        load_cell_rate=config.virtual_load_cell_rate,
        lockstep=config.faster_than_real_time,
    )
    settings = CollectSettings(
        rate=config.rate,
        command_rate=config.command_rate,
        limits=SafetyLimits(force=config.force_limit, temperature=config.temperature_limit),
        seed=config.seed,
        notes=config.notes,
    )
    operator = Terminal()
    with StopRequest() as stop, operator:
        collection = collect(
            address,
            plan,
            settings,
            config.out,
            operator,
            stop,
            title=config.plan or SINGLE_RUNS,
        )
    conclude(collection, config.out)


def planned(config: CollectConfig) -> tuple[PlannedRun, ...]:
    """Return what is to be recorded."""
    from hardware.collection.collect_plan import free_name
    from hardware.collection.excitation_plan import PlannedRun, find_plan

    if config.plan is not None:
        return find_plan(config.plan)
    words = [config.bench, config.excitation, config.obstacle]
    stem = "_".join(word for word in words if word != "free")
    return (
        PlannedRun(
            name=free_name(config.out, stem),
            bench=config.bench,
            excitation=config.excitation,
            duration=config.duration,
            split=config.split,
            obstacle=config.obstacle,
        ),
    )


def conclude(collection: Collection, out: Path) -> None:
    """Say what was recorded and what is left; what went wrong ends the verb."""
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
        f"{out}: {len(collection.outcomes)} recorded now, {collection.kept} before, "
        f"{collection.left} left"
    )
    last = collection.outcomes[-1] if collection.outcomes else None
    if last is not None and last.fault is not None:
        raise last.fault
    if last is not None and last.interrupted is not None:
        raise KeyboardInterrupt


class Terminal:
    """The operator at a terminal, or a log file in their place."""

    def __init__(self) -> None:
        self.lively = sys.stdout.isatty()
        self.period = 0.2 if self.lively else 10.0
        self.next = 0.0
        self.line = False

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the line of figures."""
        self.end_line()

    def ask(self, text: str) -> None:
        """Ask, and wait for Enter."""
        from tendon_newton.errors import InvalidParameter

        self.end_line()
        if not sys.stdin.isatty():
            raise InvalidParameter(f"someone at a terminal must be asked: {text}")
        input(f"\n>> {text}\n>> Enter when done, Ctrl-C to end. ")

    def announce(self, text: str) -> None:
        """Say what comes next."""
        self.end_line()
        print(text, flush=True)

    def tell(self, text: str) -> None:
        """Say it so that it is seen."""
        self.end_line()
        print(f"!! {text}", flush=True)

    def show(self, progress: Progress) -> None:
        """Show the figures on one line that changes, or now and then a new one."""
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + self.period
        if self.lively:
            print(f"\r{progress.text:100s}", end="", flush=True)
            self.line = True
        else:
            print(progress.text, flush=True)

    def end_line(self) -> None:
        """Go to a new line where figures stand on this one."""
        if self.line:
            print()
        self.line = False
