"""Motion of a policy on stairs on a bench, read from the log of its deployment."""

from pathlib import Path

import numpy as np

from tendon_newton.data.formats.mcap_file import messages_of
from tendon_newton.data.formats.topic_mapping import TIP_TOPIC
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_train.policy.scoring.policy_evaluation import Climb, angles_of, goal_points


def climb_on_bench(
    policy: str, log: Path, steps: Array, mechanism: Mechanism, spool_radius: float
) -> Climb:
    """Return what a deployment's log says of a climb.

    The tip is the one that the log holds. Without one the tip is computed: the asset's finger with
    this much of the first tendon wound in. Such a tip says nothing about a finger that is held. Of
    several servos the climb shows the first.

    Args:
        steps: Stamp [s], motor angles [rad], goal [rad] and commands [rad] of each step, shape
            (T, 2 D + 2).
        spool_radius: Spool radius of the bench [m].

    Raises:
        InvalidRecording: The log holds no steps.
    """
    if not len(steps):
        raise InvalidRecording(f"{log}: a deployment's log has policy steps; this file has none")
    servos = steps.shape[1] // 2 - 1
    stamp, goals = steps[:, 0], steps[:, servos + 1]
    angles, commands = steps[:, 1 : servos + 1], steps[:, servos + 2 :]
    seen = seen_tip(log)
    if seen is None:
        path = closing_path(mechanism)
        assert path.tip is not None
        at, known, place = angles[:, 0] * spool_radius, path.excursion, path.tip
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
        command=commands[:, :1],
        motor_position=angles[:, :1],
    )


def seen_tip(log: Path) -> tuple[Array, Array] | None:
    """Return stamps [s], shape (N,), and places [m], shape (N, 3), of a logged tip, if any."""
    rows = [
        (1e-9 * stamp, message.point.x, message.point.y, message.point.z)
        for _, stamp, message in messages_of(log, TIP_TOPIC)
    ]
    if not rows:
        return None
    table = np.array(rows)
    return table[:, 0], table[:, 1:]
