"""The line through the points of a calibration, and what speaks against it."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from tendon_hardware.errors import InvalidCalibration
from tendon_hardware.load_cells.calibration import (
    MASSES_MIN,
    STANDARD_GRAVITY,
    CalibrationPoint,
    LoadCellCalibration,
)
from tendon_newton.data.root_mean_square import rms

RESIDUAL_LIMIT = 0.01
"""Greatest residual as a share of the greatest load [1]: cheap cells keep 0.05 %, so 1 % is a
fixture that touches, a wrong mass or a mass hung too early."""
HYSTERESIS_LIMIT = 0.02
"""Greatest difference between loading and unloading as a share of the greatest load [1]."""


def fit_calibration(
    points: Sequence[CalibrationPoint],
    *,
    cell: str,
    gain: int,
    rate: float,
    date: str,
    gravity: float = STANDARD_GRAVITY,
) -> LoadCellCalibration:
    """Lay a line through the points and refuse it where they do not support one.

    Raises:
        InvalidCalibration: Too few masses, not both directions, counts that do not follow the
            masses, or too large a residual or hysteresis; with the reason.
    """
    refuse_incomplete(points)
    refuse_disorder(points)
    slope, tare, error = line_through(points, gravity)
    load = gravity * np.array([point.mass for point in points])
    calibration = LoadCellCalibration(
        cell=cell,
        gain=gain,
        rate=rate,
        gravity=gravity,
        date=date,
        points=tuple(points),
        tare=tare,
        slope=slope,
        residual=rms(error),
        hysteresis=abs(slope) * count_hysteresis(points),
        r_squared=float(1.0 - error @ error / ((load - load.mean()) @ (load - load.mean()))),
    )
    refuse_inaccurate(calibration)
    return calibration


def refuse_incomplete(points: Sequence[CalibrationPoint]) -> None:
    """Refuse points without a tare, three masses and both directions."""
    masses = sorted({point.mass for point in points if point.mass > 0.0})
    if len(masses) < MASSES_MIN:
        raise InvalidCalibration(
            f"a calibration needs {MASSES_MIN} different masses; there are {len(masses)}: "
            f"{listed(masses)}"
        )
    for direction in ("up", "down"):
        if not any(p.mass == 0.0 and p.direction == direction for p in points):
            raise InvalidCalibration(f"a calibration needs a tare on the way {direction}")
    # the greatest is hung once: there the way up ends and the way down begins
    for mass in masses[:-1]:
        ways = {point.direction for point in points if point.mass == mass}
        if len(ways) < 2:
            raise InvalidCalibration(
                f"every mass but the greatest must be hung up and down; {mass:g} kg was hung "
                f"{' '.join(ways)} only"
            )


def refuse_disorder(points: Sequence[CalibrationPoint]) -> None:
    """Refuse counts that do not rise, or fall, with the mass: two masses were mixed up."""
    masses = sorted({point.mass for point in points})
    means = [mean_counts(points, mass) for mass in masses]
    steps = np.diff(means)
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise InvalidCalibration(
            f"counts must follow the masses {listed(masses)}; they are "
            f"{', '.join(f'{mean:.0f}' for mean in means)}"
        )


def refuse_inaccurate(calibration: LoadCellCalibration) -> None:
    """Refuse a line that its own points contradict, naming the worst of them."""
    if calibration.hysteresis > HYSTERESIS_LIMIT * calibration.load_max:
        raise InvalidCalibration(
            f"loading and unloading must agree within {100.0 * HYSTERESIS_LIMIT:g} % of "
            f"{calibration.load_max:.3g} N; they differ by {calibration.hysteresis:.3f} N: "
            "let the mass hang free of guides and still"
        )
    if calibration.residual > RESIDUAL_LIMIT * calibration.load_max:
        mass, rest = suspect(calibration.points, calibration.gravity)
        raise InvalidCalibration(
            f"the points must lie within {100.0 * RESIDUAL_LIMIT:g} % of {calibration.load_max:.3g}"
            f" N about a line; their residual is {calibration.residual:.3f} N, and "
            f"{rest:.3f} N without {mass:g} kg: weigh that mass, and see that nothing touches"
        )


def line_through(
    points: Sequence[CalibrationPoint], gravity: float
) -> tuple[float, float, NDArray[np.float64]]:
    """Return slope [N/count], tare [counts] and errors [N] of the line nearest to the points."""
    load = gravity * np.array([point.mass for point in points])
    counts = np.array([point.counts for point in points])
    centred = counts - counts.mean()
    slope = float(centred @ (load - load.mean()) / (centred @ centred))
    tare = float(counts.mean() - load.mean() / slope)
    return slope, tare, load - (counts - tare) * slope


def suspect(points: Sequence[CalibrationPoint], gravity: float) -> tuple[float, float]:
    """Return the mass [kg] without which the others fit a line best, and their residual [N].

    The point with the greatest error is often another one: a wrong mass tilts the line.
    """
    residuals: dict[float, float] = {}
    for mass in {point.mass for point in points if point.mass > 0.0}:
        _, _, error = line_through([p for p in points if p.mass != mass], gravity)
        residuals[mass] = rms(error)
    worst = min(residuals, key=residuals.__getitem__)
    return worst, residuals[worst]


def count_hysteresis(points: Sequence[CalibrationPoint]) -> float:
    """Return the greatest difference of one mass's counts between up and down [counts]."""
    spans = [0.0]
    for mass in {point.mass for point in points}:
        up = [p.counts for p in points if p.mass == mass and p.direction == "up"]
        down = [p.counts for p in points if p.mass == mass and p.direction == "down"]
        if up and down:
            spans.append(abs(float(np.mean(up)) - float(np.mean(down))))
    return max(spans)


def mean_counts(points: Sequence[CalibrationPoint], mass: float) -> float:
    """Return the mean counts under a mass, over both directions."""
    return float(np.mean([point.counts for point in points if point.mass == mass]))


def listed(masses: Iterable[float]) -> str:
    """Write masses out [kg]."""
    return ", ".join(f"{mass:g} kg" for mass in masses) or "none"
