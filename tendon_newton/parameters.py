"""A number of an effect or an actuator: its unit, its bounds and where they come from."""

import math
from dataclasses import dataclass

from tendon_newton.errors import InvalidParameter


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One physical number with the range in which it makes sense."""

    name: str
    """Key in a model file."""
    unit: str
    """SI unit, ``1`` where it has none."""
    null: float
    """Value at which what it describes vanishes [unit]; may be infinite (a rigid tendon)."""
    nominal: float
    """Typical value, where a search starts [unit]."""
    lower: float
    """Least value that makes sense [unit]."""
    upper: float
    """Greatest value that makes sense [unit]."""
    source: str
    """Where the range comes from."""

    def __post_init__(self) -> None:
        """Refuse bounds that no number can meet."""
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
