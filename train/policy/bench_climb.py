"""What a policy did on stairs on a bench, read from the log of its deployment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tendon_newton.errors import InvalidRecording
from tendon_newton.mechanisms.mechanism import Mechanism
from tendon_newton.mechanisms.statics import closing_path
from tendon_newton.recording import Array
from tendon_newton.recording_formats.mcap_file import McapReading
from tendon_newton.recording_formats.topic_mapping import TIP_TOPIC
from train.policy.evaluation import Climb, angles_of, goal_points


def climb_on_bench(
    policy: str, log: Path, steps: Array, mechanism: Mechanism, spool_radius: float
) -> Climb:
    """Return what a deployment's log says of a climb.

    The tip is the one that the log holds. Without one it is where the finger of the asset would
    have it with this much tendon wound in, which says nothing about a finger that is held.

    Args:
        policy: Its name.
        log: The deployment's log.
        steps: Stamp [s], motor angle [rad], goal [rad] and command [rad] of each step, shape
            (T, 4).
        mechanism: The nominal finger.
        spool_radius: Of the bench [m].

    Raises:
        InvalidRecording: The log holds no steps.
    """
    if not len(steps):
        raise InvalidRecording(f"{log}: a deployment's log has policy steps; this file has none")
    stamp, angle, goals, command = np.asarray(steps, dtype=np.float64).T
    seen = seen_tip(log)
    if seen is None:
        path = closing_path(mechanism)
        assert path.tip is not None
        at, known, place = angle * spool_radius, path.excursion, path.tip
    else:
        at, known, place = stamp, *seen
    tip = np.column_stack([np.interp(at, known, place[:, axis]) for axis in range(3)])
    return Climb(
        policy=policy,
        place="bench" if seen is not None else "bench, tip from the motor",
        time=stamp - stamp[0],
        goal=goals,
        tip=tip[:, None],
        tip_angle=angles_of(mechanism, tip[:, None]),
        goal_point=goal_points(mechanism, goals),
        command=command[:, None],
        motor_position=angle[:, None],
    )


def seen_tip(log: Path) -> tuple[Array, Array] | None:
    """Return stamps [s], shape (N,), and places [m], shape (N, 3), of a logged tip, if any."""
    with log.open("rb") as file:
        rows = [
            (1e-9 * stamp, message.point.x, message.point.y, message.point.z)
            for _, stamp, message in McapReading(file, log.name).messages({TIP_TOPIC})
        ]
    if not rows:
        return None
    table = np.array(rows)
    return table[:, 0], table[:, 1:]
