"""Limits of a bench, beyond which its motor is switched off."""

from dataclasses import dataclass
from math import isfinite, pi

from tendon_newton.errors import InvalidParameter

GREATEST = {"force": 100.0, "temperature": 100.0, "silence": 60.0, "blindness": 60.0}
"""Beyond these a limit limits nothing: no servo of the table pulls 100 N on its spool."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyLimits:
    """Greatest force and temperature, the window of the spool, and how long nothing may be known.

    These limits guard the mechanism and the load cell; the servo guards itself by its own limits.
    """

    # Greatest tension [N]: the servo gives 21 N, and a cell for 5 kg takes 49 N
    force: float = 30.0
    # Greatest temperature of the motor [degC]; it shuts itself down at 70
    temperature: float = 65.0
    # Spool angles that it may have [rad]: the command range and some overshoot
    position: tuple[float, float] = (-0.5, 2.0 * pi + 0.5)
    # Longest time without a reading of the servo [s], its adapter unplugged or not
    silence: float = 10.0
    blindness: float = 3.0  # Longest time without a reading of a load cell that is there [s]

    def __post_init__(self) -> None:
        low, high = self.position
        if not (isfinite(low) and isfinite(high) and low < high):
            raise InvalidParameter(f"the position window must be low, high; it is {low}, {high}")
        for name, greatest in GREATEST.items():
            value = getattr(self, name)
            if not 0.0 < value <= greatest:
                raise InvalidParameter(
                    f"the limit of {name} must be above 0, up to {greatest:g}; it is {value:g}"
                )
