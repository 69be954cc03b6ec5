"""The finger as it moves in the telling seconds, measured and simulated side by side.

The pictures move by SVG alone: a report has no script.
"""

import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import SERVO, Array, Indices, Recording
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.reporting.held_out import WINDOW, Window
from tendon_newton.diagnosis.reporting.report_figures import full_name
from tendon_newton.mechanisms.geometry.kinematics import chain_points
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_newton.simulation.hosts.replay import bench_of

FRAMES = 20.0  # Pictures per second [Hz]
MARGIN = 0.08  # Room around all postures as a share of their extent [1]
WIDTH = 300.0  # Width of a picture, in its own units
Bones = Sequence[Array]


class ClosingPostures:
    """A mechanism's postures on its way along the friction-free equilibria.

    The first tendon closes the mechanism.

    Raises:
        InvalidParameter: The mechanism has no equilibrium.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        path = closing_path(mechanism)
        order = np.argsort(path.excursion)
        self._angle = path.excursion[order] / mechanism.tendons[0].spool_radius
        self._joints = path.joint_position[order]

    def joints_at(self, motor_angle: float) -> Array:
        """Return the joints [rad] at a motor angle [rad], shape (J,); a slack string pulls none."""
        joints: list[Array] = [np.interp(motor_angle, self._angle, q) for q in self._joints.T]
        return np.array(joints)

    def bones(self, joint_position: Array) -> list[Array]:
        """Return the ends of each bone at positions (J,) [rad] as x and -z [m], (2, 2)."""
        bones = chain_points(self.mechanism, joint_position)
        return [np.column_stack([bone[:, 0], -bone[:, 2]]) for bone in bones]


def moving_fingers(
    evidence: Evidence, model: Model, windows: Sequence[Window], *, found: bool
) -> Mapping[str, Any] | None:
    """Draw a finger in the first window of a bench that has a tip; None where none has.

    Neither is one drawn that was led, since all models move as it was measured, nor a servo alone.

    Args:
        model: The extended model, for the bench's own numbers.
        windows: Telling seconds, the most telling first.
        found: Whether causes were named, so that the models differ.
    """
    for window in windows if not evidence.test.is_led else ():
        recording = window.comparison.recording
        mechanism = override_mechanism(bench_of(recording.bench, model), recording.bench_overrides)
        drawn = recording.bench != SERVO and len(mechanism.tendons) == 1
        if drawn and mechanism.tip is not None:
            return fingers_of(evidence, window, ClosingPostures(mechanism), found=found)
    return None


def fingers_of(
    evidence: Evidence, window: Window, postures: ClosingPostures, *, found: bool
) -> Mapping[str, Any]:
    """Draw what was measured beside what the models make of it."""
    recording = window.comparison.recording
    views = zip(evidence.test.recordings, evidence.test.sources, strict=True)
    place = next(whole for r, (whole, _) in views if r is recording)
    rows = frame_rows(window)
    motions: list[tuple[str, str, list[Bones]]] = [
        ("measured", "measured", [postures.bones(q) for q in measured(recording, postures, rows)])
    ]
    models = [("before", "starting model" if found else "model", evidence.baseline)]
    models += [("after", "with the causes named", evidence.extended)] if found else []
    for style, title, values in models:
        joints = evidence.test.trajectories(values)[place].joint_position[rows]
        motions.append((style, title, [postures.bones(q) for q in joints]))
    tip = None if recording.tip is None else recording.tip[rows] * (1.0, -1.0)
    everything = [np.concatenate([p for bones in frames for p in bones]) for *_, frames in motions]
    room = box(np.concatenate(everything if tip is None else [*everything, tip]))
    return {
        "title": f"{full_name(recording.name)}, {window.start:.1f} to "
        f"{window.start + WINDOW:.1f} s",
        "seen": tip is not None,
        "pictures": [
            {"title": title, "svg": picture(title, style, frames, tip, room)}
            for style, title, frames in motions
        ],
    }


def frame_rows(window: Window) -> Indices:
    """Return the row that is shown in each picture, shape (N,)."""
    time = window.comparison.time
    last = min(window.start + WINDOW, float(time[-1]))
    instants = np.arange(window.start, last, 1.0 / FRAMES)
    return np.searchsorted(time, instants).clip(0, len(time) - 1)


def measured(recording: Recording, postures: ClosingPostures, rows: Indices) -> list[Array]:
    """Return the postures [rad] that a motor's angles tell."""
    return [postures.joints_at(float(angle)) for angle in recording.motor_position[rows, 0]]


def box(points: Array) -> tuple[float, float, float, float]:
    """Return left, top, width and height [m] of what holds some points, shape (N, 2)."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = MARGIN * float((high - low).max())
    return (*(low - room), *(high - low + 2.0 * room))


def picture(
    title: str,
    style: str,
    frames: Sequence[Bones],
    tip: Array | None,
    room: tuple[float, float, float, float],
) -> str:
    """Draw one finger that moves, as part of a page."""
    left, top, width, height = room
    scale = WIDTH / width

    def at(point: Array) -> str:
        return f"{scale * (point[0] - left):.1f} {scale * (point[1] - top):.1f}"

    paths = [" ".join(f"M{at(b[0])} L{at(b[1])}" for b in bones) for bones in frames]
    seconds = len(frames) / FRAMES
    base, size = at(frames[0][0][0]).split(" "), 0.03 * WIDTH
    parts = [
        f'<path class="bones {style}" d="{paths[0]}">{moved("d", paths, seconds)}</path>',
        f'<circle class="base" cx="{base[0]}" cy="{base[1]}" r="{size:.0f}"/>',
    ]
    if tip is not None:
        places = [at(point).split(" ") for point in tip]
        motion = "".join(
            moved(key, [place[k] for place in places], seconds)
            for k, key in enumerate(("cx", "cy"))
        )
        x, y = places[0]
        parts.append(
            f'<circle class="tip" cx="{x}" cy="{y}" r="{0.5 * size:.0f}">{motion}</circle>'
        )
    label = html.escape(f"The finger, {title}, as it moves")
    return (
        f'<svg class="finger" role="img" aria-label="{label}" '
        f'viewBox="0 0 {WIDTH:.0f} {scale * height:.0f}">{"".join(parts)}</svg>'
    )


def moved(attribute: str, values: Sequence[str], seconds: float) -> str:
    """Let an attribute take values one after the other, again and again."""
    return (
        f'<animate attributeName="{attribute}" dur="{seconds:g}s" repeatCount="indefinite" '
        f'values="{";".join(values)}"/>'
    )
