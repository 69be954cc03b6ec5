"""Numbers of a bench that differ from its asset, from a dataset entry or a model file.

`mechanisms.geometry.overrides` puts them into a mechanism.
"""

from dataclasses import dataclass, fields
from typing import Any

from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import is_list, is_table
from tendon_newton.errors import InvalidParameter, look_up, shown

# key -> (least value, greatest value, unit): the ranges catch grams for kilograms and millimetres
# for metres; a moment arm may be negative (it opens the joint)
BENCH_OVERRIDE_RANGES: dict[str, tuple[float, float, str]] = {
    "mass": (1e-9, 100.0, "kg"),
    "length": (1e-9, 10.0, "m"),
    "arm_mass": (0.0, 100.0, "kg"),
    "stiffness": (0.0, 1e6, "N/m or N m/rad"),
    "damping": (0.0, 1e5, "N s/m or N m s/rad"),
    "range": (1e-9, 10.0, "m or rad"),
    "moment_arm": (-10.0, 10.0, "m/rad or 1"),
    "tendon_compliance": (1e-2, 1e2, "1"),
    "tendon_slack": (1e-2, 1e2, "1"),
    "routing_friction": (1e-2, 1e2, "1"),
    "joint_dry_friction": (1e-2, 1e2, "1"),
}
OF_BENCH = {
    "tendon_compliance": "stiffness",
    "tendon_slack": "length",
    "routing_friction": "exponent",
    "joint_dry_friction": "fraction",
}
"""Effects that every bench has in a size of its own, those of its line and its joints -> number."""


@dataclass(frozen=True, kw_only=True)
class BenchOverrides:
    """Numbers of a bench that differ from its asset, one per joint; ``None`` keeps the asset's.

    Those of `OF_BENCH` are one number each.
    """

    mass: tuple[float, ...] | None = None  # Mass of the link that each joint carries [kg]
    length: tuple[float, ...] | None = None  # Length of that link [m]
    # Mass of an even arm from each joint to the centre of that link, on top of its mass [kg]
    arm_mass: tuple[float, ...] | None = None
    stiffness: tuple[float, ...] | None = None  # Return spring of each joint [N/m or N m/rad]
    damping: tuple[float, ...] | None = None  # Damping of each joint [N s/m or N m s/rad]
    range: tuple[float, ...] | None = None  # Travel of each joint from zero [m or rad]
    moment_arm: tuple[float, ...] | None = None  # Tendon excursion per joint motion [m/rad or 1]
    # How many times the first number of such an effect is what the model says of all benches [1]
    tendon_compliance: tuple[float, ...] | None = None
    tendon_slack: tuple[float, ...] | None = None
    routing_friction: tuple[float, ...] | None = None
    joint_dry_friction: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for key, (lower, upper, unit) in BENCH_OVERRIDE_RANGES.items():
            values: tuple[float, ...] | None = getattr(self, key)
            if values is None:
                continue
            if not values:
                raise InvalidParameter(f"bench override {key!r} must have one value per joint")
            if key in OF_BENCH and len(values) > 1:
                raise InvalidParameter(
                    f"bench override {key!r} must be one number for the line of a bench; "
                    f"it has {len(values)}"
                )
            for value in values:
                if not lower <= value <= upper:
                    raise InvalidParameter(
                        f"bench override {key!r} must lie in [{lower:g}, {upper:g}] {unit}; "
                        f"it is {value:g}"
                    )

    @property
    def given(self) -> dict[str, tuple[float, ...]]:
        """The numbers that differ, by key."""
        return {f.name: values for f in fields(self) if (values := getattr(self, f.name))}


def read_bench_overrides(table: Any) -> BenchOverrides:
    """Read bench numbers from a table of a file; a lone number counts as a tuple of one."""
    if not is_table(table):
        raise InvalidParameter(f"bench_overrides must be a table of numbers; it is {shown(table)}")
    values: dict[str, tuple[float, ...]] = {}
    for key, value in table.items():
        look_up("bench override", key, BENCH_OVERRIDE_RANGES)
        items = value if is_list(value) else [value]
        for item in items:
            if finite_number(item) is None:
                raise InvalidParameter(
                    f"bench override {key!r} must be a finite number or a list of them; "
                    f"it is {shown(value)}"
                )
        values[key] = tuple(float(item) for item in items)
    return BenchOverrides(**values)


def write_bench_overrides(overrides: BenchOverrides) -> dict[str, float | list[float]]:
    """Make the TOML table of bench numbers; a tuple of one becomes a lone number."""
    return {
        key: values[0] if len(values) == 1 else list(values)
        for key, values in overrides.given.items()
    }
