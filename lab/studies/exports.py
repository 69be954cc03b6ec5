"""How far exported models stray from our own simulation: each bench, actuator and effect.

Effects have a number that shows, the standard commands of an export, and our own solver at steps of
6 us as the truth. A force is its mean while a command is held, as a load cell shows it. The results
go to exports.json beside this file; docs/export.md shows them. What stands there is not run again:
take numbers out after a change of the exports.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import Departure, departure, pooled, replayed, standard_runs
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of
from tendon_newton.simulation.hosts.rollout import Candidates, Stepping, Trajectory
from tendon_newton.simulation.model.parameter_table import spool_radius_of
from tests.exports.models import ACTUATORS, TYPICAL, model_of

RESULTS = Path(__file__).with_suffix(".json")
TRUTH_STEP = 6.25e-6
"""Step of our own solver [s]: with twice as much the play of a rotor moves by 0.4 mrad and 0.004 N,
and all else by less."""
SAMPLES = 50
"""Readings of a force while a command is held: of a servo that switches in each step, their mean is
0.03 N sharp."""
KEYS = ("bench", "actuator", "effect")  # What names a row of the results
BENCHES = ("finger", "spring_weak", "spring_strong", "thumb", "pendulum")


def cases(target: str) -> list[tuple[str, str, tuple[str, ...]]]:
    """Return (bench, actuator, effects of which each is tried alone) for a target."""
    held = tuple(name for name, kind in EXPORTS[target].coverage.items() if kind != "none")
    return [
        (bench, actuator, held if bench == "finger" and actuator in ("ideal", "pwm_servo") else ())
        for bench in BENCHES
        for actuator in ACTUATORS
        if (bench, actuator) != ("pendulum", "learned")  # it has no string whose force was learned
    ]


def truths(
    bench: str, actuator: str, effects: tuple[str, ...], runs: list[Recording]
) -> list[list[Trajectory]]:
    """Return our own simulation without effects, then with each of them, by one kernel."""
    plain = model_of(bench, actuator)
    rollout = rollout_of(
        bench_of(bench, plain), runs, plain, candidates=Candidates(effects=effects),
        stepping=Stepping(time_step=TRUTH_STEP),
    )  # fmt: skip
    models = [plain, *(model_of(bench, actuator, effect) for effect in effects)]
    return rollout.run(np.stack([rollout.base_vectors(model) for model in models]))


def strays(
    target: str,
    model: Model,
    runs: list[Recording],
    ours: list[Trajectory],
    known: Collection[str] = (),
) -> dict[str, list[float]]:
    """Return how far each way of running an export strays [mrad, N], but for those known."""
    mechanism = bench_of(runs[0].bench, model)
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        exported = EXPORTS[target].write(Path(folder), mechanism, model)
        for way in exported.replays:
            if way not in known:
                theirs = replayed(EXPORTS[target], exported, way, model, runs)
                out[way] = in_units(departed(mechanism, theirs, ours))
    return out


def departed(
    mechanism: Mechanism, one: Sequence[Trajectory], other: Sequence[Trajectory]
) -> Departure:
    """Return how far runs that `finely` made lie apart; a force is its mean over a command."""
    away = [a.force - b.force for a, b in zip(one, other, strict=True)]
    means = [x.reshape(-1, SAMPLES, x.shape[1]).mean(axis=1) for x in away]
    return replace(departure(mechanism, one, other), force=pooled(means))


def finely(recording: Recording, samples: int) -> Recording:
    """Return a recording with so many rows for each; every command is held as long as before.

    A load cell shows the mean force of a while. A force that jumps, or that switches in every step,
    has no value at an instant that two simulators could agree on.
    """
    time = recording.time
    interval = np.diff(time, append=2.0 * time[-1] - time[-2])
    inside = np.arange(samples) / samples
    rows = {
        f.name: np.repeat(values, samples, axis=0)
        for f in fields(recording)
        if isinstance(values := getattr(recording, f.name), np.ndarray)
    }
    fine = (time[:, None] + interval[:, None] * inside).ravel()
    return replace(recording, **{**rows, "time": fine, "extra": {}})


def in_units(found: Departure) -> list[float]:
    """Return a departure in [mrad, N]."""
    assert found.force is not None
    return [round(1e3 * found.angle, 4), round(found.force, 5)]


def completed(
    target: str, bench: str, actuator: str, rows: list[dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Yield rows of one bench and actuator with the numbers that they lack.

    Args:
        target: Where models go.
        bench: Name of the bench.
        actuator: A key of `ACTUATORS`.
        rows: What is known: one row for each effect alone, None for the actuator without any.
    """
    plain = model_of(bench, actuator)
    mechanism = bench_of(bench, plain)
    runs = [finely(run, SAMPLES) for run in standard_runs(mechanism, spool_radius_of(plain))]
    named = tuple(row["effect"] for row in rows if row["effect"] is not None)
    unaffected, *affected = truths(bench, actuator, named, runs)
    truth = {None: unaffected, **dict(zip(named, affected, strict=True))}
    for row in rows:
        effect, ours = row["effect"], truth[row["effect"]]
        model = plain if effect is None else model_of(bench, actuator, effect)
        worth = {}
        if effect:
            found = departed(mechanism, unaffected, ours)
            worth["worth"] = in_units(found)
        yield row | worth | strays(target, model, runs, ours, row)


def ways_of(target: str, bench: str, actuator: str) -> set[str] | str:
    """Return in what ways an export of a bench can be run, or why there is none."""
    model = model_of(bench, actuator)
    with tempfile.TemporaryDirectory() as folder:
        try:
            return set(EXPORTS[target].write(Path(folder), bench_of(bench, model), model).replays)
        except InvalidModelFile as error:
            return str(error)


def main(words: list[str]) -> None:
    """Run the cases of some targets that have no numbers yet, and keep what comes."""
    quiet_warp()
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for target in words or list(EXPORTS):
        known = {tuple(row[key] for key in KEYS): row for row in kept.get(target, [])}
        for bench, actuator, effects in cases(target):
            asked = [(bench, actuator, effect) for effect in (None, *effects)]
            rows = [known.setdefault(key, dict(zip(KEYS, key, strict=True))) for key in asked]
            ways = ways_of(target, bench, actuator)
            if isinstance(ways, str):
                rows[0]["refused"] = ways
                continue
            left = [row for row in rows if not ways <= set(row)]
            for row in completed(target, bench, actuator, left) if left else ():
                known[tuple(row[key] for key in KEYS)] = row
                print(target, row, flush=True)
                keep(kept, target, known.values())
        keep(kept, target, known.values())


def keep(kept: dict[str, Any], target: str, rows: Iterable[dict[str, Any]]) -> None:
    """Write what is known of a target beside what is known of others."""
    kept[target] = [row for row in rows if len(row) > len(KEYS)]
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    assert set(TYPICAL) == set(EFFECTS)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(EXPORTS)}")
    main(parser.parse_args().targets)
