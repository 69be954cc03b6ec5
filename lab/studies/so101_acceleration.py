"""Real SO-101 logs: the goal's acceleration in a fast sweep, ``... so101_acceleration LOGS``.

Fits two models to each joint's sweep alone: lag, delay, deadband and offset, and the same behind a
goal that speeds up and slows down at bounded accelerations. Prints what each leaves of the sweep,
of its fast end and of the motions that were not fitted, and how fast a shaft starts into jumps.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lab.studies.so101 import SWEEP, joints
from lab.studies.so101_pairs import FIXED, TOLD
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

MODELS = {"four numbers": FIXED, "with a profile": ("acceleration_limit", *FIXED)}
FAST_END = 111.0  # When the sweep reaches 2.9 Hz [s]
JUMPS = "static_holding"
LEAST_JUMP = 0.1  # Of a command, from row to row [rad]
STARTING = 4  # Rows after a jump in which the shaft is looked for to start


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    imported = read_so101(parser.parse_args().logs)
    for joint in joints(imported):
        logs = {
            str(log.conditions["motion"]): log.recording
            for log in imported.logs
            if log.conditions["joint"] == joint
        }
        report(joint, logs, TOLD)


def report(joint: str, logs: dict[str, Recording], model: Model) -> None:
    """Print what both models leave of one joint's motions, and its starts into jumps."""
    motions = [SWEEP, *(motion for motion in logs if motion != SWEEP)]
    every = Study([logs[motion] for motion in motions], model, tuple(EFFECTS))
    sweep = Study([logs[SWEEP]], model, tuple(EFFECTS))
    for name, effects in MODELS.items():
        numbers, (of_sweep, *others) = fitted(sweep, every, model, effects)
        late = logs[SWEEP].time - logs[SWEEP].time[0] > FAST_END
        held = others[motions.index(JUMPS) - 1]
        print(
            f"{joint}, {name}: sweep {rms(of_sweep):.1f} mrad, its end {rms(of_sweep[late]):.1f}, "
            f"other motions {rms(np.concatenate(others)):.1f}, jumps {rms(held):.1f}; {numbers}",
            flush=True,
        )
    if found := starts(logs[JUMPS]):
        words = ", ".join(f"{jump:+.2f}: {most:.0f}" for jump, most in found)
        print(f"{joint}: greatest acceleration [rad/s^2] by jump [rad]: {words}")


def fitted(
    sweep: Study, every: Study, model: Model, effects: Sequence[str]
) -> tuple[str, list[np.ndarray]]:
    """Fit effects to a sweep; return their numbers in words and the errors of all motions [rad]."""
    worlds = SearchWorlds(sweep)
    found = fit_set_anew(worlds, model, effects)
    values = values_of(worlds, found.columns, found.place)
    owners = sweep.table.owners
    words = ", ".join(f"{owners[c][0]} {owners[c][1].name} {v:.3g}" for c, v in values.items())
    residuals = every.residuals(*replacements([values]))
    return words, [np.where(r.trusted, r.theta[0], 0.0) for r in residuals]


def rms(errors: np.ndarray) -> float:
    """Return a root mean square [mrad]."""
    return 1e3 * float(np.sqrt(np.mean(errors**2)))


def starts(recording: Recording) -> list[tuple[float, float]]:
    """Return jumps of the command [rad], each with the shaft's greatest acceleration [rad/s^2].

    The acceleration is the change of the rows' mean speed, in the direction of the jump.
    """
    assert recording.command is not None
    step = float(np.median(np.diff(recording.time)))
    jumps = np.diff(recording.command[:, 0])
    speeds = np.diff(recording.motor_position[:, 0]) / step
    return [
        (
            float(jumps[k]),
            float((np.sign(jumps[k]) * np.diff(speeds[k : k + STARTING + 1]) / step).max()),
        )
        for k in np.flatnonzero(np.abs(jumps) >= LEAST_JUMP)
    ]


if __name__ == "__main__":
    main()
