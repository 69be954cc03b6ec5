"""Numbers as a reader wants them: with a unit of the right size, and no finer than known."""

import math
from typing import Protocol


class Known(Protocol):
    """A number with its interval."""

    @property
    def value(self) -> float:
        """In its unit."""
        ...

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval."""
        ...

    @property
    def unit(self) -> str:
        """SI unit."""
        ...


FINER: dict[str, tuple[float, float, str]] = {
    # unit -> below this size, divide by this, and write this instead
    "s": (0.5, 1e-3, "ms"),
    "rad": (0.1, 1e-3, "mrad"),
    "m": (0.5, 1e-3, "mm"),
    "1": (math.inf, 1.0, ""),
    "1/s": (0.1, 1e-2, "% per second"),
}
SHARES = (
    ("gear_load_friction", "coefficient"),
    ("joint_dry_friction", "fraction"),
    ("load_dependent_friction", "coefficient"),
    ("load_stribeck_friction", "coefficient"),
    ("load_stribeck_friction", "static_coefficient"),
    ("viscoelastic_spring", "stiffness_ratio"),
)
"""(effect, parameter) without a unit that reads best in per cent."""
LEAST = 5.0e-7  # A smaller number is written as none
LARGE = 1.0e4  # Numbers from here on are written in thousands


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits and no exponent."""
    if abs(value) < LEAST or not math.isfinite(value):
        return f"{value:g}".replace("inf", "∞") if abs(value) >= LEAST else "0"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit, in the multiple that reads best."""
    factor, name = finer(value, unit)
    return f"{number(value / factor)} {name}".rstrip()


def finer(value: float, unit: str) -> tuple[float, str]:
    """Return the multiple of a unit in which a value reads best."""
    if unit == "N/m" and abs(value) >= LARGE:
        return 1e3, "N/mm"
    below, factor, name = FINER.get(unit, (0.0, 1.0, unit))
    return (factor, name) if abs(value) < below else (1.0, unit)


def is_share(owner: str, parameter: str) -> bool:
    """Tell whether a parameter reads best in per cent."""
    return (owner, parameter) in SHARES


def estimate_text(owner: str, parameter: str, estimate: Known) -> tuple[str, str]:
    """Return a fitted number and its interval, no finer than the interval resolves."""
    factor, unit = finer(estimate.value, estimate.unit)
    if is_share(owner, parameter):
        factor, unit = 1e-2, "%"
    value, low, high = (x / factor for x in (estimate.value, *estimate.ci95))
    spread = max(value - low, high - value, abs(value) * 1e-3)
    decimals = 0
    if math.isfinite(spread) and spread > 0.0:
        decimals = min(4, max(0, 1 - math.floor(math.log10(spread))))
    shown = [f"{x:.{decimals}f}".replace("-", "−").replace("inf", "∞") for x in (value, low, high)]
    return f"{shown[0]} {unit}".rstrip(), f"{shown[1]} to {shown[2]} {unit}".rstrip()
