"""A cart on a rail or a mass on a shaft in a few numbers, in plain SI units of any size."""

from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Literal

from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.authoring.asset_folder import write_layers
from tendon_newton.mechanisms.authoring.asset_plan import (
    NUMBER_FILTERS,
    STOP_DAMPING_RATIO,
    check_name,
)

Kind = Literal["slider", "shaft", "cart"]
TEMPLATES: dict[Kind, str] = {"slider": "new_slider", "shaft": "new_shaft", "cart": "new_slider"}
# Numbers of a cart that a string pulls where none is given: those of the weak spring bench
CART = {
    "mass": 0.05, "range": 0.08, "damping": 5.0, "stiffness": 200.0, "force_limit": 21.0,
    "spool_radius": 0.0125,
}  # fmt: skip
# Numbers of a machine from a watch to a crane; units as in `DirectPlan`
RANGES: dict[str, tuple[float, float]] = {
    "mass": (1e-6, 1e6),
    "length": (1e-4, 100.0),
    "range": (1e-4, 1e3),
    "damping": (0.0, 1e6),
    "stiffness": (0.0, 1e9),
    "force_limit": (1e-6, 1e6),
    "spool_radius": (1e-4, 10.0),
}
# By this share of its range [1] a cart enters a stop that holds its drive's full force
STOP_GIVE = 1e-3


@dataclass(frozen=True, kw_only=True)
class DirectPlan:
    """A bench whose drive pushes as well as pulls, or a cart that a string pulls."""

    name: str
    # A cart on a rail, a mass on an arm that hangs from a shaft, or a cart on a string
    kind: Kind
    mass: float  # Mass of the cart, or at the arm's end [kg]
    length: float = 0.1  # Length of the arm [m]; a slider has none
    # Travel of the cart from stop to stop, the middle at 0, with a string the open end [m]; a
    # shaft turns freely
    range: float = 1.0
    damping: float = 0.0  # Viscous damping [N s/m], of a shaft [N m s/rad]
    stiffness: float = 0.0  # Spring to the middle [N/m], of a shaft to straight down [N m/rad]
    force_limit: float = 100.0  # The most that the drive can give [N], of a shaft [N m]
    spool_radius: float | None = None  # Of the spool that winds the string [m]; None without one

    def __post_init__(self) -> None:
        """Refuse names and numbers that are none."""
        check_name(self.name)
        for key, (low, high) in RANGES.items():
            value = getattr(self, key)
            if value is not None and not low <= value <= high:
                raise InvalidAsset(
                    f"{key} of a {self.kind} must lie in [{low:g}, {high:g}] in SI units; it is "
                    f"{value:g}"
                )

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the cart's travel [m]."""
        half = 0.0 if self.spool_radius else 0.5 * self.range
        return -half, self.range - half

    @property
    def cube(self) -> float:
        """Inertia of a cube of the mass with edges of 0.1 m [kg m^2]."""
        return self.mass * 0.1**2 / 6.0

    @property
    def speck(self) -> float:
        """Inertia that stands for a point's [kg m^2]."""
        return 1e-6 * self.mass * self.length**2

    @property
    def stop_stiffness(self) -> float:
        """Stiffness of the end stops [N/m]."""
        return self.force_limit / (STOP_GIVE * self.range)

    @property
    def stop_damping(self) -> float:
        """Damping of the end stops [N s/m]."""
        return 2.0 * STOP_DAMPING_RATIO * sqrt(self.stop_stiffness * self.mass)


def write_direct_asset(folder: Path, plan: DirectPlan) -> Path:
    """Write a bench into a new folder of its name, and return the file to open.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    return write_layers(folder, TEMPLATES[plan.kind], ("interface",), plan, NUMBER_FILTERS)
