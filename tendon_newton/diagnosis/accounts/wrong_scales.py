"""Signals that are not what the model takes them for: another unit, a gear, a gain of another kind.

A cause that a search names for such data is wrong, however much of the gap it explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.actuators.ideal import Ideal
from tendon_newton.data.model_file import Model
from tendon_newton.data.plain_numbers import number
from tendon_newton.data.recording import Array, Recording
from tendon_newton.identification.study import Residual, Study

UNITS: dict[str, tuple[tuple[float, str], ...]] = {
    "theta": (
        (57.3, "degrees in place of rad"),
        (1e3, "mrad in place of rad"),
        (1.0 / 57.3, "turned from degrees to rad twice"),
    ),
    "force": (
        (1e3, "mN in place of N"),
        (1e-3, "kN in place of N"),
        (0.102, "kgf in place of N"),
        (102.0, "gf in place of N"),
        (0.2248, "lbf in place of N"),
    ),
}
"""Signal -> measured over true value, and what was then taken for what."""
NEAR_UNIT = 0.15  # How near a ratio must be to one of a unit, as a share of it [1]
FOLLOWS = 0.9  # Correlation of measured and simulated from which their ratio means a unit [1]
# Times by which an angle is larger or smaller than its servo's, which its force proves right [1]:
# spools that are off by half are a cause
GEARED, SAME_FORCE, SAME_ANGLE = 3.0, 2.0, 1.5
FAR = 5.0  # Times by which a gain is off that no spread of servos, a factor of 3, explains [1]
SLOW = 0.05  # Speed below which a servo rests [rad/s]
LEAST_ROWS = 20  # Fewer tell no slope


@dataclass(frozen=True, kw_only=True)
class Suspect:
    """Something about the data that no cause should be made of."""

    recording: str
    text: str  # What was seen and what follows, in sentences
    stops: bool = False  # Whether no cause may be named beside it


def wrong_units(recordings: Sequence[Recording], base: Sequence[Residual]) -> Iterator[Suspect]:
    """Find signals that follow the simulated one in another unit."""
    found: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for recording, residual in zip(recordings, base, strict=True):
        pairs = [("theta", recording.motor_position[:, 0], residual.theta[0])]
        if recording.force is not None and residual.force is not None:
            pairs.append(("force", recording.force[:, 0], residual.force[0]))
        for signal, measured, missed in pairs:
            ratio = ratio_of(measured[residual.trusted], (measured - missed)[residual.trusted])
            for unit, words in UNITS[signal]:
                if ratio is not None and abs(ratio / unit - 1.0) < NEAR_UNIT:
                    found.setdefault((signal, words), []).append((recording.name, ratio))
    for (signal, words), rows in found.items():
        (name, ratio), more = rows[0], len(rows) - 1
        others = f" and {more} more recordings" if more else ""
        yield Suspect(
            recording=name,
            text=f"{name}{others}: {signal} is {ratio:.3g} times what the model gives and follows "
            f"it otherwise: {words}? Mend the unit and diagnose again. No cause should be made of "
            "this.",
        )


def ratio_of(measured: Array, simulated: Array) -> float | None:
    """Return by what a signal must be multiplied to give another that follows it; else None."""
    a, b = measured - measured.mean(), simulated - simulated.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b / (b @ b)) if size > 0.0 and abs(float(a @ b)) > FOLLOWS * size else None


def wrong_scales(study: Study, model: Model, base: Sequence[Residual]) -> Iterator[Suspect]:
    """Find angles behind a gear, and gains that are not those of the data."""
    recordings = study.recordings
    angles: list[float] = []
    forces: list[float] = []
    for recording, residual in zip(recordings, base, strict=True):
        rows, theta = residual.trusted, recording.motor_position[:, 0]
        ratio = ratio_of(theta[rows], (theta - residual.theta[0])[rows])
        if ratio is not None and recording.force is not None and residual.force is not None:
            force = recording.force[:, 0]
            angles.append(ratio)
            forces.append(ratio_of(force[rows], (force - residual.force[0])[rows]) or np.inf)
    angle, force = 1.0, 1.0
    if 2 * len(angles) > len(recordings):
        # a gear is the same in every recording; something in the way is not
        angle = min(angles, key=lambda ratio: abs(np.log(abs(ratio))))
        force = float(np.median(forces))
    if far(angle, GEARED) and not far(force, SAME_FORCE):
        yield Suspect(
            recording=recordings[0].name,
            text=f"theta is {number(angle)} times what the model gives, and the force is what it "
            "gives: the angle is not that of the spool. Is it measured before or behind a gear, or "
            f"another joint's? Multiply it (scale = {number(1.0 / angle)} in the mapping), or "
            "state command and angle of one shaft, and diagnose again. No cause should be made of "
            "this.",
            stops=True,
        )
        return
    of_force = far(force, SAME_FORCE) and not far(angle, SAME_ANGLE)  # in another unit itself
    if not of_force and (found := gain_apart(study, model)) is not None:
        yield found


def far(ratio: float, factor: float) -> bool:
    """Tell whether a ratio is beyond a factor, up or down."""
    return not 1.0 / factor <= abs(ratio) <= factor


def gain_apart(study: Study, model: Model) -> Suspect | None:
    """Hold the force at rest against command minus angle, and its slope against the stated gain."""
    if model.actuator.name != Ideal.name or "gain" in model.fit:
        return None
    slopes: list[float] = []
    for recording in study.recordings:
        gain = {**model.actuator.values, **recording.actuator_overrides}.get("gain")
        slope = slope_at_rest(recording)
        if slope is not None and isinstance(gain, float):
            slopes.append(slope / gain)
    if 2 * len(slopes) <= len(study.recordings) or not far(ratio := float(np.median(slopes)), FAR):
        return None
    radius = model.actuator.values.get("spool_radius")
    radius = radius if isinstance(radius, float) else study.mechanisms[0].tendons[0].spool_radius
    kind = ""
    if abs(ratio * radius - 1.0) < 0.5:
        kind = " It is N m/rad in place of N/rad: divide it by the spool's radius."
    return Suspect(
        recording=study.recordings[0].name,
        text=f"At rest the force grows by {number(ratio)} times the gain for each rad between "
        f"command and angle: the model's gain is not that of the data.{kind} Mend it, or list it "
        'in fit = ["gain"], and diagnose again. No cause should be made of this.',
        stops=True,
    )


def slope_at_rest(recording: Recording) -> float | None:
    """Return the slope [N/rad] of force against command minus angle, of rows at rest."""
    if recording.command is None or recording.force is None:
        return None
    speed = np.gradient(recording.motor_position[:, 0], recording.time)
    rest = recording.enabled & (np.abs(speed) < SLOW)
    apart = (recording.command[:, 0] - recording.motor_position[:, 0])[rest]
    force = recording.force[rest, 0]
    return ratio_of(force, apart) if len(force) >= LEAST_ROWS else None
