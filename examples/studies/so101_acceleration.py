"""Real SO-101 logs: is there a limit of acceleration? ``... so101_acceleration LOGS``.

Prints how much of what the named causes leave of the sweep lies in its fast end, and what a limit
of acceleration before lag and deadband makes of two things: the fast half of the sweep, and a jump
of the command. The limit is no effect of the catalogue: the two do not ask for the same. The
accelerations with which every joint starts into its jumps are printed as well.
"""

import argparse
from math import copysign, exp, sqrt
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from tendon_newton.data.importers.so101 import read_so101
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.identification.study import Study

FOUND = {
    "Rotation": {
        "actuator_lag": {"time_constant": 0.0486},
        "command_delay": {"delay": 0.0383},
        "deadband": {"width": 0.0086},
    },
    "Wrist_Roll": {
        "actuator_lag": {"time_constant": 0.0585},
        "command_delay": {"delay": 0.0230},
        "deadband": {"width": 0.0101},
    },
}
"""What pairs with the sweep find (`examples.studies.so101_pairs`), about their middle."""
FAST_END = 111.0
"""When the sweep reaches 2.9 Hz [s]."""
FAST_HALF = 60.0  # [s]
JUMP = 72.196
"""When `static_holding` jumps furthest [s]."""
LEAST_JUMP = 0.1
"""Of a command, from row to row [rad]."""
STARTING = 4
"""Rows after a jump in which the shaft is looked for to start."""
LIMITS = (30.0, 35.0, 40.0, 45.0, 50.0, 80.0, 1.0e6)
"""Accelerations [rad/s^2]; the last is none."""
PARTS = 4
"""Steps per row."""
STARTS = ((0.03, 0.06, 0.006, 0.0), (0.01, 0.02, 0.010, 0.0))
LOWER, UPPER = (0.0, 0.002, 0.0, -0.1), (0.15, 0.3, 0.05, 0.1)
SIZES = (0.02, 0.03, 0.005, 0.01)
"""Delay [s], lag [s], deadband [rad], offset [rad]: starts, bounds and typical sizes."""


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    logs = {log.recording.name: log.recording for log in read_so101(parser.parse_args().logs).logs}
    for joint, effects in FOUND.items():
        sweep = logs[f"{joint}_chirp_sweep.csv"]
        time = sweep.time - sweep.time[0]
        left = 1.0e3 * error_of(sweep, effects)
        slow, fast = (np.sqrt(np.mean(left[r] ** 2)) for r in (time < FAST_END, time >= FAST_END))
        share = np.sum(left[time >= FAST_END] ** 2) / np.sum(left**2)
        print(
            f"{joint}: the named causes leave {slow:.1f} mrad of the sweep before {FAST_END:.0f} s "
            f"and {fast:.1f} after, which is {share:.0%} of the squared error"
        )
        holding = logs[f"{joint}_static_holding.csv"]
        held = holding.time - holding.time[0]
        parts = (
            ("fast half of the sweep", sweep, time > FAST_HALF),
            ("a jump of 0.3 rad", holding, (held > JUMP - 0.4) & (held < JUMP + 1.2)),
        )
        for what, recording, rows in parts:
            errors = ", ".join(
                f"{limit:g}: {1.0e3 * least_error(recording, rows, limit):.1f}" for limit in LIMITS
            )
            print(f"  {what}, error [mrad] by limit [rad/s^2]: {errors}", flush=True)
    for name, recording in logs.items():
        if name.endswith("_static_holding.csv") and (found := starts(recording)):
            words = ", ".join(f"{jump:+.2f}: {most:.0f}" for jump, most in found)
            print(f"{name}: greatest acceleration [rad/s^2] by jump [rad]: {words}")


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


def error_of(recording: Recording, effects: dict[str, dict[str, float]]) -> Array:
    """Return measured minus simulated angle [rad] under some effects, shape (T,)."""
    named = tuple(NamedValues(name=name, values=values) for name, values in effects.items())
    model = Model(actuator=NamedValues(name="ideal_position", values={}), effects=named)
    (simulated,) = Study([recording], model, tuple(effects)).trajectories({})
    return (recording.motor_position - simulated.motor_position)[:, 0]


def least_error(recording: Recording, rows: Mask, limit: float) -> float:
    """Return the RMS error [rad] that the best delay, lag, deadband and offset leave."""
    assert recording.command is not None
    goal, theta = recording.command[rows, 0], recording.motor_position[rows, 0]
    step = float(np.median(np.diff(recording.time)))
    fits = [
        least_squares(
            lambda numbers: followed(goal, theta[0], step, numbers, limit) - theta,
            start,
            bounds=(LOWER, UPPER),
            x_scale=SIZES,
            diff_step=3.0e-3,
            max_nfev=15,
        )
        for start in STARTS
    ]
    return sqrt(2.0 * min(fit.cost for fit in fits) / len(theta))


def followed(goal: Array, start: float, step: float, numbers: Array, limit: float) -> Array:
    """Return where a shaft is whose drive cannot accelerate beyond a limit, shape (T,).

    Args:
        goal: Commanded angle [rad], shape (T,).
        start: First angle [rad].
        step: Time from row to row [s].
        numbers: Delay [s], lag [s], deadband [rad] and offset [rad].
        limit: Acceleration of the drive [rad/s^2]; it brakes in time for its goal.
    """
    delay, lag, band, offset = numbers
    h = step / PARTS
    taken = 1.0 - exp(-h / lag)
    drive = shaft = float(start)
    speed = 0.0
    out = np.empty(len(goal))
    for k in range(len(goal)):
        out[k] = shaft
        for part in range(PARTS):
            told = goal[max(0, int(np.floor(k + part / PARTS - delay / step)))]
            way = told - drive
            wanted = copysign(min(sqrt(2.0 * limit * abs(way)), abs(way) / h), way)
            speed += min(max(wanted - speed, -limit * h), limit * h)
            drive += speed * h
            error = drive + offset - shaft
            if abs(error) > band:
                shaft += taken * (error - copysign(band, error))
    return out


if __name__ == "__main__":
    main()
