"""Calibration of a load cell: counts to newtons, from known masses, with what speaks for it."""

import hashlib
from dataclasses import dataclass
from math import isfinite
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tendon_hardware.errors import InvalidCalibration
from tendon_hardware.load_cells.load_cell_type import SATURATED_COUNTS

STANDARD_GRAVITY = 9.80665
"""Gravity by definition [m/s^2]; at sea level it is 9.780 at the equator and 9.832 at the poles."""
MASSES_MIN = 3
DRIFT_LIMIT = 0.05
"""Shift of zero over a session that is worth a warning [N]; noise of the bench's force."""

Direction = Literal["up", "down"]


@dataclass(frozen=True, kw_only=True, slots=True)
class CalibrationPoint:
    """The cell under one known mass."""

    mass: float
    """Mass that hangs on the tendon [kg]; 0 is the tare."""
    direction: Direction
    """Whether the load was going up or down."""
    counts: float
    """Mean of the readings [counts]."""
    sigma: float
    """Standard deviation of one reading [counts]."""
    readings: int
    """Readings in the mean."""
    duration: float
    """Time that they took [s]."""

    def __post_init__(self) -> None:
        """Refuse what no cell can have measured."""
        if not (isfinite(self.mass) and self.mass >= 0.0):
            raise InvalidCalibration(f"a mass must be 0 kg or more; it is {self.mass}")
        if not (isfinite(self.counts) and isfinite(self.sigma) and self.readings > 0):
            raise InvalidCalibration(
                f"the readings under {self.mass:g} kg must be numbers; mean {self.counts}, "
                f"sigma {self.sigma}, {self.readings} readings"
            )
        low, high = min(SATURATED_COUNTS), max(SATURATED_COUNTS)
        if not low < self.counts < high:
            raise InvalidCalibration(
                f"the cell must stay inside its range; under {self.mass:g} kg it is saturated: "
                "use a lower gain or smaller masses"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadCellCalibration:
    """Straight line from counts to newtons, and the measurements behind it."""

    cell: str
    """Name that the operator gave the cell."""
    gain: int
    """Gain of the converter: 128, 64 or 32."""
    rate: float
    """Readings per second while it was calibrated [1/s]."""
    gravity: float
    """Gravity where it was calibrated [m/s^2]."""
    date: str
    """Day and time, ISO 8601 with its zone."""
    points: tuple[CalibrationPoint, ...]
    """All measurements, in the order in which they were made."""
    tare: float
    """Counts without load."""
    slope: float
    """Newtons per count; negative where the cell is wired the other way round."""
    residual: float
    """Root mean square of the points about the line [N]."""
    hysteresis: float
    """Greatest difference between loading and unloading [N]."""
    r_squared: float
    """Share of the points' variance that the line explains [1]."""

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

    def counts(self, force: ArrayLike) -> NDArray[np.float64]:
        """Return the counts of a tension [N]."""
        return np.asarray(force, dtype=np.float64) / self.slope + self.tare

    def drift(self, counts: float) -> float:
        """Return how far zero has moved [N], from the mean counts of a later tare."""
        return float(self.force(counts))
