"""How well a hand has turned a ball, from the log of a deployment."""

from pathlib import Path

import numpy as np

from tendon_hardware.deployment.deploy_log import read_steps
from tendon_newton.data.cards.turning_task import TurningTask
from tendon_newton.data.formats.mcap_file import messages_of, read_session
from tendon_newton.data.formats.topic_mapping import FORCE_TOPIC, TRUTH_TOPIC
from tendon_newton.data.recording import Array
from tendon_newton.data.turning_figures import MINUTE, TurningFigures, turning_figures
from tendon_newton.errors import InvalidRecording

POSE = 7  # Numbers of a ball's place [m] and quaternion (x, y, z, w), at the front of what is true


def read_truth(path: Path) -> tuple[Array, Array, Array]:
    """Read what a virtual hand's log says is true.

    Returns:
        Stamps [s], shape (T,); places [m] and quaternions (x, y, z, w) of the ball, shape (T, 7);
        joint angles, finger by finger [rad], shape (T, J).

    Raises:
        InvalidRecording: The log says nothing of a ball.
    """
    rows = [
        (1e-9 * stamp, *map(float, message.data))
        for _, stamp, message in messages_of(path, TRUTH_TOPIC)
    ]
    if len(rows) < 2:
        raise InvalidRecording(
            f"{path}: the log of a virtual hand has the true pose of its ball on {TRUTH_TOPIC}; "
            "this one has none"
        )
    table = np.array(rows, dtype=np.float64)
    return table[:, 0], table[:, 1 : 1 + POSE], table[:, 1 + POSE :]


def log_figures(path: Path, task: TurningTask) -> TurningFigures:
    """Measure what a virtual ball did while a policy drove, by the figures of training.

    The ball starts where it was at the first policy step.

    Raises:
        InvalidRecording: The log says nothing of a ball, of a tension or of a policy.
    """
    time, pose, _ = read_truth(path)
    first, last = driven_span(path)
    driven = pose[(time >= first) & (time <= last)]
    return turning_figures(
        task,
        period=float(np.mean(np.diff(time))),
        pose=driven[:, None],
        start=driven[0, :3],
        tension=np.array(read_tensions(path))[:, None, None],
    )


def turning_text(path: Path, task: TurningTask) -> str:
    """Say how well a hand has turned a ball, in a line.

    Without what only a virtual bench knows, the turn is what the camera saw.
    """
    session = read_session(path)
    if session.get("simulated") == "True":
        return f"turned: {log_figures(path, task).text}"
    first, last = driven_span(path)
    turned, drops = (
        float(session[f"ball.{name}"]) * MINUTE / (last - first) for name in ("turned_rad", "drops")
    )
    return f"{turned:.1f} rad/min, {drops:.2f} drops/min, at most {max(read_tensions(path)):.1f} N"


def driven_span(path: Path) -> tuple[float, float]:
    """Return the stamps of the first and the last policy step [s].

    Raises:
        InvalidRecording: There are no two.
    """
    stamps = [step.time for step in read_steps(path)]
    if len(stamps) < 2:
        raise InvalidRecording(f"{path}: a policy's run has two steps at least")
    return stamps[0], stamps[-1]


def read_tensions(path: Path) -> list[float]:
    """Read all tensions of a log [N].

    Raises:
        InvalidRecording: There is none.
    """
    forces = [float(message.wrench.force.x) for *_, message in messages_of(path, FORCE_TOPIC)]
    if not forces:
        raise InvalidRecording(f"{path}: a load cell's tension is in the log; there is none")
    return forces
