"""A load cell's calibration: its points, the line through them, and its TOML file."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import isfinite
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tendon_hardware.errors import InvalidCalibration
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.root_mean_square import rms

STANDARD_GRAVITY = 9.80665
"""Gravity by definition [m/s^2]; at sea level it is 9.780 at the equator and 9.832 at the poles."""
MASSES_MIN = 3
DRIFT_LIMIT = 0.05
"""Shift of zero over a session that is worth a warning [N]; noise of the bench's force."""

Direction = Literal["up", "down"]


@dataclass(frozen=True, kw_only=True, slots=True)
class CalibrationPoint:
    """The cell under one known mass."""

    mass: float  # Mass that hangs on the tendon [kg]; 0 is the tare
    direction: Direction  # Whether the load was going up or down
    counts: float  # Mean of the readings [counts]
    sigma: float  # Standard deviation of one reading [counts]
    readings: int  # Readings in the mean
    duration: float  # Time that they took [s]

    def __post_init__(self) -> None:
        if not (isfinite(self.mass) and self.mass >= 0.0):
            raise InvalidCalibration(f"a mass must be 0 kg or more; it is {self.mass}")
        if not (isfinite(self.counts) and isfinite(self.sigma) and self.readings > 0):
            raise InvalidCalibration(
                f"the readings under {self.mass:g} kg must be numbers; mean {self.counts}, "
                f"sigma {self.sigma}, {self.readings} readings"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadCellCalibration:
    """Straight line from counts to newtons, and the measurements behind it."""

    cell: str  # Name that the operator gave the cell
    gain: int  # Gain of the converter: 128, 64 or 32
    rate: float  # Readings per second while it was calibrated [1/s]
    gravity: float  # Gravity where it was calibrated [m/s^2]
    date: str  # Day and time, ISO 8601 with its zone
    points: tuple[CalibrationPoint, ...]  # All measurements, in the order in which they were made
    tare: float  # Counts without load
    slope: float  # Newtons per count; negative where the cell is wired the other way round
    residual: float  # Root mean square of the points about the line [N]
    hysteresis: float  # Greatest difference between loading and unloading [N]
    r_squared: float  # Share of the points' variance that the line explains [1]

    @property
    def identifier(self) -> str:
        """Hash of what was measured, by which logs name a calibration.

        The line is left out: its last bits depend on the computer.
        """
        content = (self.cell, self.gain, self.rate, self.gravity, self.date, self.points)
        return hashlib.sha256(repr(content).encode()).hexdigest()[:12]

    @property
    def noise(self) -> float:
        """Standard deviation of one reading without load [N]."""
        tares = [point.sigma for point in self.points if point.mass == 0.0]
        return abs(self.slope) * float(np.mean(tares))

    @property
    def load_max(self) -> float:
        """Greatest load that was hung [N]; beyond it the line is a guess."""
        return self.gravity * max(point.mass for point in self.points)

    def force(self, counts: ArrayLike) -> NDArray[np.float64]:
        """Return the tension of counts [N]."""
        return (np.asarray(counts, dtype=np.float64) - self.tare) * self.slope


SETTING_KEYS = ("cell", "gain", "rate", "gravity", "date")
RESULT_KEYS = ("identifier", "tare", "slope", "residual", "hysteresis", "r_squared")


def write_calibration(path: Path, calibration: LoadCellCalibration) -> None:
    """Write a calibration whole or not at all."""
    facts = {key: getattr(calibration, key) for key in (*SETTING_KEYS, *RESULT_KEYS)}
    write_partial(path, facts, calibration.points)


def load_calibration(path: Path) -> LoadCellCalibration:
    """Read a calibration and make sure that nobody has changed it.

    The line is fitted again from the points in the file; results are there for a reader.

    Raises:
        InvalidCalibration: The file is no calibration, or has the identifier of another one.
    """
    if not path.is_file():
        raise InvalidCalibration(f"{path}: a calibration is a TOML file; there is none")
    table = CheckedTable(read_toml(path, InvalidCalibration), str(path), InvalidCalibration)
    refuse_unknown_keys(
        table.values, (*SETTING_KEYS, *RESULT_KEYS, "points"), table.where, InvalidCalibration
    )
    points, settings = read_points(table), read_settings(table)
    try:
        calibration = fit_calibration(points, **settings)
    except InvalidCalibration as error:
        raise InvalidCalibration(f"{path}: {error}") from error
    if table.values.get("identifier") != calibration.identifier:
        raise InvalidCalibration(
            f"{path}: its identifier must be {calibration.identifier}, the hash of its points and "
            f"settings; it is {table.values.get('identifier')!r}: the file was changed by hand"
        )
    return calibration


def write_partial(
    path: Path, settings: Mapping[str, Any], points: Sequence[CalibrationPoint]
) -> None:
    """Keep the points of a calibration that is not complete."""
    write_toml(path, dict(settings), points=[asdict(point) for point in points])


def load_partial(path: Path) -> tuple[dict[str, Any], list[CalibrationPoint]]:
    """Read the settings and points of an interrupted calibration."""
    table = read_toml(path, InvalidCalibration)
    points = read_points(CheckedTable(table, str(path), InvalidCalibration))
    del table["points"]
    return table, points


def read_points(table: CheckedTable) -> list[CalibrationPoint]:
    """Read the ``[[points]]`` tables."""
    for row in table.tables("points"):
        known = [field.name for field in fields(CalibrationPoint)]
        refuse_unknown_keys(row.values, known, row.where, InvalidCalibration)
    return list(table.value("points", tuple[CalibrationPoint, ...]))


def read_settings(table: CheckedTable) -> dict[str, Any]:
    """Read what stands beside the points."""
    return {
        "cell": table.word("cell"),
        "date": table.word("date"),
        "gain": table.whole("gain"),
        "rate": table.number("rate"),
        "gravity": table.number("gravity"),
    }


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
    means = [np.mean([point.counts for point in points if point.mass == m]) for m in masses]
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


def listed(masses: Iterable[float]) -> str:
    """Write masses out [kg]."""
    return ", ".join(f"{mass:g} kg" for mass in masses) or "none"
