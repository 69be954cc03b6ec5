"""A number of an effect or an actuator: its unit, its bounds and where they come from."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, replace

from tendon_newton.errors import InvalidParameter

DIMENSIONS: dict[str, tuple[int, int, int]] = {
    "N": (1, 0, 0),
    "N/s": (1, 0, 0),
    "1/N": (-1, 0, 0),
    "1/N2": (-2, 0, 0),
    "rad": (0, 1, 0),
    "rad/s": (0, 1, 0),
    "rad/s2": (0, 1, 0),
    "1/rad": (0, -1, 0),
    "N/rad": (1, -1, 0),
    "N s/rad": (1, -1, 0),
    "m": (0, 0, 1),
    "N/m": (1, 0, -1),
    "s/m": (0, 0, -1),
    "kg m2": (1, -2, 1),
    "rad/(N m)": (-1, 0, -1),
    "N s/m": (1, 0, -1),
    "N s2/m": (1, 0, -1),
    "m/rad": (0, -1, 1),
}
"""Unit -> powers of force, motor angle and tendon excursion; seconds are the same on any bench."""
ON_A_SHAFT: dict[str, str] = {
    "N": "N m",
    "N/s": "N m/s",
    "1/N": "1/(N m)",
    "1/N2": "1/(N m)2",
    "N/rad": "N m/rad",
    "N s/rad": "N m s/rad",
    "m": "rad",
    "N/m": "N m/rad",
    "s/m": "s/rad",
    "rad/(N m)": "rad/(N m)",
}
"""Unit at a string -> unit where a shaft is turned, whose excursion is its angle."""
TIME_POWERS: dict[str, int] = {
    "s": 1, "1/s": -1, "N/s": -1, "N m/s": -1, "rad/s": -1, "rad/s2": -2, "N s/rad": 1,
    "N m s/rad": 1, "N s/m": 1, "N s2/m": 2, "s/m": 1, "s/rad": 1, "kg m2": 2,
}  # fmt: skip
"""Unit -> power of time, where there is one and forces are measured: an inertia is in N m s2."""
FORCE_POWERS: dict[str, int] = {
    name: powers[0]
    for unit, powers in DIMENSIONS.items()
    for name in (unit, ON_A_SHAFT.get(unit, unit))
}
"""Unit -> power of force, at a string and on a shaft."""
SMALLEST, GREATEST = 1.0e-4, 1.0e4
"""Factors on a range within which a machine of any size may have a number."""
LED = 10.0
"""Times by which springs of a shaft that is led may be weaker or stiffer than anywhere else."""


@dataclass(frozen=True, kw_only=True)
class BenchScale:
    """Ratios of a bench's numbers to those of the nominal benches, for which ranges are stated."""

    force: float = 1.0  # Ratio of the forces [1]
    travel: float = 1.0  # Ratio of the tendon's travel [1]
    turn: float = 1.0  # Ratio of the motor angle for the same travel [1]
    # Whether forces are torques [N m], because a shaft stands in for the string
    is_shaft: bool = False
    # Whether its shaft is led both ways, so that no spring needs to bring a joint back
    is_led: bool = False

    @property
    def force_unit(self) -> str:
        """Unit of a force."""
        return ON_A_SHAFT["N"] if self.is_shaft else "N"

    @property
    def force_name(self) -> str:
        """Name of the force at the load cell."""
        return "shaft torque" if self.is_shaft else "tendon force"

    def factor(self, unit: str) -> float:
        """Return how large a number of some unit is beside that of the nominal benches [1]."""
        force, angle, length = DIMENSIONS.get(unit, (0, 0, 0))
        return self.force**force * (self.travel * self.turn) ** angle * self.travel**length


@dataclass(frozen=True)
class Parameter:
    """One physical number with the range in which it makes sense on the nominal benches."""

    name: str  # Key in a model file
    unit: str  # SI unit, ``1`` where it has none
    _: KW_ONLY
    # Value at which what it describes vanishes [unit]; may be infinite (a rigid tendon)
    null: float
    nominal: float  # Typical value, where a search starts [unit]
    lower: float  # Least value that makes sense [unit]
    upper: float  # Greatest value that makes sense [unit]
    source: str = ""  # Source of the range
    # Whether the range is the same on a bench of any size, whatever the unit: a tilt's
    absolute: bool = False
    of_spring: bool = False  # Whether its range holds where a spring must bring its joint back
    optional: bool = False  # Whether a model may leave it out, and so at its null
    # Effect without which it does nothing; it acts only where a spool moves on its own
    needs: str = ""
    # Unit in which it grows with forces and times, where its own does not say it: that of what a
    # scale multiplies, newtons of a share of a motor's force, none of a reading
    of: str = ""
    # Standard deviation by which a sound bench differs from what drawing, data sheet or
    # calibration state: a share of what is stated where that cannot be zero, else [unit].
    # Zero where nothing states it.
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lower) and math.isfinite(self.upper)):
            raise InvalidParameter(
                f"the bounds of {self.name!r} must be finite; they are "
                f"[{self.lower}, {self.upper}] {self.unit}"
            )
        if not self.lower <= self.nominal <= self.upper:
            raise InvalidParameter(
                f"{self.name!r} must satisfy lower <= nominal <= upper; came "
                f"{self.lower} <= {self.nominal} <= {self.upper} {self.unit}"
            )
        if math.isnan(self.null):
            raise InvalidParameter(f"the null value of {self.name!r} must be a number; it is nan")

    def since(self, source: str) -> Parameter:
        """Return it with the source of its range."""
        return replace(self, source=source)

    @property
    def time_power(self) -> int:
        """Power of time that it has where forces are measured."""
        return TIME_POWERS.get(self.of or self.unit, 0)

    @property
    def force_power(self) -> int:
        """Power by which it grows where all forces grow, and motions and readings do not."""
        return FORCE_POWERS.get(self.of or self.unit, 0)

    @property
    def travel_power(self) -> int:
        """Power by which it grows where tendons travel further for the same turns of a motor."""
        return DIMENSIONS.get(self.of or self.unit, (0, 0, 0))[2]

    @property
    def widest(self) -> tuple[float, float]:
        """Bounds [unit] that hold for machines of any size: what a model file may state."""
        if self.absolute or self.unit not in DIMENSIONS:
            wider = LED if self.of_spring else 1.0
            return self.lower / wider, self.upper * wider
        low = self.lower * (SMALLEST if self.lower > 0.0 else GREATEST)
        return low, self.upper * GREATEST

    def on(self, scale: BenchScale) -> Parameter:
        """Return what it is on a bench of another size; its null stays."""
        factor = 1.0 if self.absolute else scale.factor(self.unit)
        wider = LED if self.of_spring and scale.is_led else 1.0
        return replace(
            self,
            unit=ON_A_SHAFT.get(self.unit, self.unit) if scale.is_shaft else self.unit,
            lower=self.lower * factor / wider,
            nominal=self.nominal * factor,
            upper=self.upper * factor * wider,
            tolerance=self.tolerance * (1.0 if self.lower > 0.0 else factor),
        )

    def holding(self, value: float) -> Parameter:
        """Return it with a range that holds a value which a model states [unit]."""
        return replace(self, lower=min(self.lower, value), upper=max(self.upper, value))


def with_unit(value: str, unit: str) -> str:
    """Return a number with its unit behind it; a pure number has none."""
    return value if unit == "1" else f"{value} {unit}"
