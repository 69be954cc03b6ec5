"""What rerun shows of one recording: the finger, its tensions and angles, the goal, what happened.

Posture: a servo tells its own angle alone. A measured finger stands in the friction-free
equilibrium of that angle, as its asset has it; a simulated one stands where the model puts it.
"""

from pathlib import Path
from typing import Any, Literal

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, MissingDependency, TendonNewtonError
from tendon_newton.mechanisms.geometry.closing_postures import ClosingPostures
from tendon_newton.mechanisms.loading import load_mechanism

View = Literal["window", "file"]
TIMELINE = "time"
LONGEST = 9.0e9  # Greatest instant of a view [s]: 64 bits of nanoseconds
COLORS = {
    "measured": (31, 111, 139),
    "simulated": (209, 96, 61),
    "command": (138, 143, 152),
    "goal": (184, 134, 11),
    "tip": (43, 47, 54),
}
"""Colours of what is drawn, red green blue."""
THICKNESS = 0.012  # Half the thickness of a bone as a share of the finger's length [1]
MARGIN = 0.15  # Room around all postures as a share of the finger's length [1]


class BenchScene:
    """One recording in rerun.

    Args:
        bench: Name under ``assets/`` of the bench, or a USD file.
        to: A window, which opens, or a file.
        file: The recording's own file; that of the view has its name and ends in ``.rrd``.
        goals: Whether a policy's goals will be shown.

    Raises:
        MissingDependency: rerun is not installed, or its viewer is not found.
    """

    def __init__(self, name: str, bench: str, to: View, file: Path, *, goals: bool = False) -> None:
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
        self.postures = postures_of(bench)
        # The view's file; none of a window
        self.target: Path | None = file.with_suffix(".rrd") if to == "file" else None
        blueprint = arrangement(layout, self.postures, goals=goals)
        if self.target is None:
            try:
                self.stream.spawn(default_blueprint=blueprint)
            except RuntimeError as error:  # in rerun's own words, a page of them
                raise MissingDependency(
                    "a window needs rerun's viewer, the program 'rerun', on the path: activate the "
                    "environment that it is installed in; --to file needs none"
                ) from error
        else:
            self.stream.save(self.target, default_blueprint=blueprint)
        for place in ("tension/measured", "tension/simulated", "angle/measured", "angle/simulated",
                      "angle/command"):  # fmt: skip
            who = place.split("/")[1]
            mode = "StepAfter" if who == "command" else "Linear"
            lines = rerun.SeriesLines(colors=[COLORS[who]], names=[who], interpolation_mode=mode)
            self.stream.log(place, lines, static=True)

    def at(self, seconds: float) -> None:
        """Say at which instant of the recording [s] all that follows is.

        Raises:
            InvalidRecording: No view has room for it.
        """
        if not abs(seconds) < LONGEST:
            raise InvalidRecording(
                f"a view shows instants within {LONGEST:g} s of a recording's first; one is at "
                f"{seconds:g} s"
            )
        self.stream.set_time(TIMELINE, duration=seconds)

    def angle(self, who: str, value: float, tendon: int = 0) -> None:
        """Show a motor's angle [rad]; the finger of the first one stands accordingly."""
        self.stream.log(entity("angle", who, tendon), self._rerun.Scalars(value))
        if who == "measured" and tendon == 0 and self.postures is not None:
            self.bones(who, self.postures.joints_at(value))

    def bones(self, who: str, joint_position: Array) -> None:
        """Show the finger in a posture [rad], shape (J,)."""
        if self.postures is not None:
            bones = self.postures.bones(joint_position)
            radius = THICKNESS * self.postures.size
            strips = self._rerun.LineStrips2D(bones, radii=radius, colors=[COLORS[who]])
            self.stream.log(f"finger/{who}", strips)

    def point(self, what: str, x: float, z: float) -> None:
        """Show a point of the finger's plane [m]: the tip that was seen, or the goal."""
        if self.postures is not None:
            radius = 2.0 * THICKNESS * self.postures.size
            points = self._rerun.Points2D([[x, -z]], radii=radius, colors=[COLORS[what]])
            self.stream.log(f"finger/{what}", points)

    def goal(self, alpha: float) -> None:
        """Show the goal angle of a policy [rad] as the point of the tip's path that has it."""
        self.stream.log("goal/alpha", self._rerun.Scalars(alpha))
        if self.postures and (place := self.postures.goal_point(alpha)) is not None:
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


def arrangement(layout: Any, postures: ClosingPostures | None, *, goals: bool) -> Any:
    """Return where the panels stand: the finger on the left, signals and events on the right."""
    signals = {"tension": "tension [N]", "angle": "motor angle [rad]"}
    signals |= {"goal": "goal angle [rad]"} if goals else {}
    panels = [layout.TimeSeriesView(origin=place, name=name) for place, name in signals.items()]
    panels.append(layout.TextLogView(origin="events", name="events and safety"))
    right = layout.Vertical(*panels)
    if postures is None:
        return layout.Blueprint(right, collapse_panels=True)
    low, high = postures.extent()
    room = MARGIN * postures.size
    bounds = layout.VisualBounds2D(
        x_range=[low[0] - room, high[0] + room], y_range=[low[1] - room, high[1] + room]
    )
    finger = layout.Spatial2DView(origin="finger", name="finger", visual_bounds=bounds)
    return layout.Blueprint(
        layout.Horizontal(finger, right, column_shares=[2, 3]),
        layout.TimePanel(state="collapsed"),
        collapse_panels=True,
    )


def postures_of(bench: str) -> ClosingPostures | None:
    """Return the postures of a bench; a log of another computer's asset has its signals alone."""
    try:
        return ClosingPostures(load_mechanism(bench))
    except TendonNewtonError:
        return None
