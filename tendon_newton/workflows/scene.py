"""What rerun shows of one recording: the finger, its tensions and angles, the goal, what happened.

Posture: a servo tells its own angle alone. So a measured finger stands in the friction-free
equilibrium of that angle, as its asset has it; a simulated one stands where the model puts it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import MissingDependency, TendonNewtonError
from tendon_newton.mechanisms.authoring.asset_view import chain_points
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_newton.mechanisms.loading import load_mechanism

View = Literal["window", "file"]
TIMELINE = "time"
COLORS = {
    "measured": (31, 111, 139),
    "simulated": (209, 96, 61),
    "command": (138, 143, 152),
    "goal": (184, 134, 11),
    "tip": (43, 47, 54),
}
"""Colours of what is drawn, red green blue."""
THICKNESS = 0.02
"""Thickness of a bone as a share of the finger's length."""


class Scene:
    """One recording in rerun.

    Args:
        name: Name of the recording.
        bench: Name under ``assets/`` of the bench, or a USD file.
        to: A window, which opens, or a file.
        file: The recording's own file; that of the view has its name and ends in ``.rrd``.

    Raises:
        MissingDependency: rerun is not installed.
    """

    def __init__(self, name: str, bench: str, to: View, file: Path) -> None:
        try:
            import rerun
            import rerun.blueprint as layout
        except ModuleNotFoundError as error:
            raise MissingDependency(
                "a view needs the package 'rerun-sdk', which is not installed; "
                "pip install 'tendon-newton[view]'"
            ) from error
        self._rerun = rerun
        self.stream: Any = rerun.RecordingStream("tendon-newton", recording_id=name)
        self.posture = Posture(bench)
        self.target: Path | None = file.with_suffix(".rrd") if to == "file" else None
        """The view's file; none of a window."""
        blueprint = arrangement(layout)
        if self.target is None:
            self.stream.spawn(default_blueprint=blueprint)
        else:
            self.stream.save(self.target, default_blueprint=blueprint)
        for place in ("tension/measured", "tension/simulated", "angle/measured", "angle/simulated",
                      "angle/command"):  # fmt: skip
            who = place.split("/")[1]
            lines = rerun.SeriesLines(colors=[COLORS[who]], names=[who])
            self.stream.log(place, lines, static=True)

    def at(self, seconds: float) -> None:
        """Say at which instant of the recording [s] all that follows is."""
        self.stream.set_time(TIMELINE, duration=seconds)

    def angle(self, who: str, value: float, tendon: int = 0) -> None:
        """Show a motor's angle [rad]; the finger of the first one stands accordingly."""
        self.stream.log(entity("angle", who, tendon), self._rerun.Scalars(value))
        if who == "measured" and tendon == 0:
            self.bones(who, self.posture.joints_at(value))

    def bones(self, who: str, joint_position: Array | None) -> None:
        """Show the finger in a posture [rad], shape (J,)."""
        if joint_position is None:
            return
        bones, size = self.posture.bones(joint_position)
        strips = self._rerun.LineStrips2D(bones, radii=THICKNESS * size, colors=[COLORS[who]])
        self.stream.log(f"finger/{who}", strips)

    def point(self, what: str, x: float, z: float) -> None:
        """Show a point of the finger's plane [m]: the tip that was seen, or the goal."""
        size = THICKNESS * self.posture.size
        points = self._rerun.Points2D([[x, -z]], radii=2.0 * size, colors=[COLORS[what]])
        self.stream.log(f"finger/{what}", points)

    def goal(self, alpha: float) -> None:
        """Show the goal angle of a policy [rad] as the point of the tip's path that has it."""
        self.stream.log("goal/alpha", self._rerun.Scalars(alpha))
        if (place := self.posture.goal_point(alpha)) is not None:
            self.point("goal", *place)

    def tension(self, who: str, newtons: float, tendon: int = 0) -> None:
        """Show a tension [N]."""
        self.stream.log(entity("tension", who, tendon), self._rerun.Scalars(newtons))

    def say(self, text: str, level: str) -> None:
        """Show what happened: ``info``, ``warn`` or ``error``."""
        self.stream.log("events", self._rerun.TextLog(text, level=level.upper()))

    def close(self) -> None:
        """Hand over all that was shown."""
        self.stream.flush()
        self.stream.disconnect()


def entity(signal: str, who: str, tendon: int) -> str:
    """Return where a signal of a tendon stands; the first one's place has no number."""
    return f"{signal}/{who}" if tendon == 0 else f"{signal}/{who}_{tendon}"


def arrangement(layout: Any) -> Any:
    """Return where the panels stand: the finger on the left, signals and events on the right."""
    return layout.Blueprint(
        layout.Horizontal(
            layout.Spatial2DView(origin="finger", name="finger"),
            layout.Vertical(
                layout.TimeSeriesView(origin="tension", name="tension [N]"),
                layout.TimeSeriesView(origin="angle", name="motor angle [rad]"),
                layout.TimeSeriesView(origin="goal", name="goal angle [rad]"),
                layout.TextLogView(origin="events", name="events and safety"),
                row_shares=[3, 3, 2, 2],
            ),
            column_shares=[2, 3],
        ),
        layout.TimePanel(state="collapsed"),
        collapse_panels=True,
    )


class Posture:
    """A mechanism's postures on its way along the equilibria.

    Args:
        bench: Name under ``assets/``, or a USD file; of what is not here nothing is drawn.
    """

    def __init__(self, bench: str) -> None:
        self.mechanism: Mechanism | None = None
        self.size = 1.0
        """Length of the bones together [m]."""
        try:
            mechanism = load_mechanism(bench)
            self._path = closing_path(mechanism)
        except TendonNewtonError:  # a log of another computer's asset still has its signals
            return
        radius = mechanism.tendons[0].spool_radius
        order = np.argsort(self._path.excursion)
        self._angle = self._path.excursion[order] / radius
        self._joints = self._path.joint_position[order]
        self.mechanism = mechanism
        self.size = self.bones(self._joints[0])[1]

    def joints_at(self, motor_angle: float) -> Array | None:
        """Return the joints [rad] in equilibrium at a motor angle [rad], shape (J,)."""
        if self.mechanism is None:
            return None
        return np.array([np.interp(motor_angle, self._angle, q) for q in self._joints.T])

    def bones(self, joint_position: Array) -> tuple[list[Array], float]:
        """Return the ends of the bones in the plane of x and z, z upward [m], and their length."""
        assert self.mechanism is not None
        bones = [
            np.column_stack([bone[:, 0], -bone[:, 2]])  # rerun counts downward
            for bone in chain_points(self.mechanism, joint_position)
        ]
        size = sum(float(np.linalg.norm(bone[1] - bone[0])) for bone in bones)
        return bones, size or 1.0

    def goal_point(self, alpha: float) -> tuple[float, float] | None:
        """Return x and z [m] of the tip's path at a goal angle [rad]."""
        if self.mechanism is None or self._path.tip is None:
            return None
        x, z = self._path.tip[:, 0], self._path.tip[:, 2]
        row = int(np.argmin(np.abs(np.arctan2(-z, x) - alpha)))
        return float(x[row]), float(z[row])
