"""A finger in a few numbers, and the USD layers of it that one starts from."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path

from tendon_newton.errors import InvalidAsset, listed, shown
from tendon_newton.mechanisms.authoring.asset_folder import write_layers

LAYERS = ("interface", "geometry", "physics", "tendon")
RESERVED = (*LAYERS, "base", "tip")  # Names that a file or a prim of a new asset has already
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
SLENDERNESS = 0.13  # Radius over length of a drawn bone [1], that of the nominal finger
STOP_STIFFNESS = 30.0  # Stiffness of the end stops [N m/rad], that of the nominal finger
# Damping ratio [1] of a stop against all that swings outward of its joint: it rings once
STOP_DAMPING_RATIO = 0.4
# How templates write numbers: as they are, and what USD wants in degrees
NUMBER_FILTERS: dict[str, Callable[[float], str]] = {
    "number": lambda value: f"{value:.8g}",
    "degrees": lambda value: f"{180.0 / pi * value:.9g}",
    "per_degree": lambda value: f"{pi / 180.0 * value:.8g}",
}
# Numbers of a finger: outside, millimetres, grams or degrees slipped in
RANGES: dict[str, tuple[float, float, str]] = {
    "length": (1e-3, 0.5, "m"),
    "mass": (1e-4, 10.0, "kg"),
    "moment_arm": (-0.1, 0.1, "m"),
    "stiffness": (1e-5, 5.0, "N m/rad"),
    "range": (0.12, pi, "rad"),
    "damping": (0.0, 1.0, "N m s/rad"),
    "spool_radius": (1e-3, 0.1, "m"),
    "force_limit": (0.1, 1000.0, "N"),
}


@dataclass(frozen=True, kw_only=True)
class PlannedJoint:
    """One joint and the link that it moves; links are slender rods."""

    name: str
    carrier: str  # Prim that it sits on
    start: float  # Distance of its axis from the first axis, the finger straight [m]
    offset: float  # Length of the link before it [m]
    length: float  # Length of its link [m]
    mass: float  # Mass of its link [kg]
    moment_arm: float  # Tendon excursion per joint angle [m/rad], positive closes
    stiffness: float  # Return spring [N m/rad]
    range: float  # Angle at which it is closed [rad]
    damping: float  # Viscous damping [N m s/rad]
    stop_damping: float  # Damping of the end stops [N m s/rad]
    stop_stiffness: float = STOP_STIFFNESS  # Stiffness of the end stops [N m/rad]

    @property
    def radius(self) -> float:
        """Radius of the drawn bone [m]."""
        return SLENDERNESS * self.length

    @property
    def inertia_across(self) -> float:
        """Inertia about the centre of mass, across the bone [kg m^2]."""
        return self.mass * self.length**2 / 12.0

    @property
    def inertia_along(self) -> float:
        """Inertia about the bone's own axis [kg m^2]."""
        return self.mass * self.radius**2 / 2.0


@dataclass(frozen=True, kw_only=True)
class AssetPlan:
    """A finger: joints in a row with parallel axes, closed by one tendon, opened by springs."""

    name: str
    joints: tuple[PlannedJoint, ...]
    spool_radius: float  # Spool radius [m]
    force_limit: float  # The most that its servo can pull [N]


def plan_asset(
    name: str,
    joints: tuple[str, ...],
    *,
    spool_radius: float,
    force_limit: float,
    **numbers: tuple[float, ...],
) -> AssetPlan:
    """Plan a finger.

    Args:
        name: Name of the asset: a word of letters, digits and _.
        joints: Names of the joints, from the base to the tip.
        spool_radius: Spool radius [m].
        force_limit: The most that its servo can pull [N].
        numbers: length [m], mass [kg], moment_arm [m], stiffness [N m/rad], range [rad] and
            damping [N m s/rad]: one value per joint, or one for all of them.

    Raises:
        InvalidAsset: A name is none, a value is missing or is no finger's.
    """
    for word in (name, *joints):
        check_name(word)
    if len(set(joints)) < len(joints) or not joints:
        raise InvalidAsset(f"joints need names that differ; they are {shown(joints)}")
    table = {key: spread(key, values, len(joints)) for key, values in numbers.items()}
    check_range("spool_radius", spool_radius)
    check_range("force_limit", force_limit)
    lengths, masses = table["length"], table["mass"]
    planned = tuple(
        PlannedJoint(
            name=joint,
            carrier=f"{joints[k - 1]}_link" if k else "base",
            start=sum(lengths[:k]),
            offset=lengths[k - 1] if k else 0.0,
            stop_damping=stop_damping(lengths[k:], masses[k:]),
            **{key: values[k] for key, values in table.items()},
        )
        for k, joint in enumerate(joints)
    )
    return AssetPlan(name=name, joints=planned, spool_radius=spool_radius, force_limit=force_limit)


def check_name(word: str, reserved: tuple[str, ...] = RESERVED) -> None:
    """Refuse a name that no prim can have, or that one has already."""
    if not NAME.fullmatch(word) or word in reserved:
        raise InvalidAsset(
            "names of assets and joints are words of letters, digits and _, and not "
            f"{listed(reserved)}; {shown(word)} is none"
        )


def spread(key: str, values: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Return one value per joint of a number that may have been given once for all."""
    if len(values) not in (1, count):
        raise InvalidAsset(
            f"{key} needs one value, or one per joint: {count}; it has {len(values)}"
        )
    for value in values:
        check_range(key, value)
    return values if len(values) == count else values * count


def check_range(key: str, value: float) -> None:
    """Refuse a number that no finger has."""
    low, high, unit = RANGES[key]
    if not low <= value <= high:
        raise InvalidAsset(f"{key} must lie in [{low:g}, {high:.4g}] {unit}; it is {value:g}")


def stop_damping(lengths: tuple[float, ...], masses: tuple[float, ...]) -> float:
    """Return a damping for the stops of a joint [N m s/rad], from the straight rods beyond it."""
    inertia, start = 0.0, 0.0
    for length, mass in zip(lengths, masses, strict=True):
        inertia += mass * (length**2 / 12.0 + (start + length / 2.0) ** 2)
        start += length
    return 2.0 * STOP_DAMPING_RATIO * sqrt(STOP_STIFFNESS * inertia)


def write_asset(folder: Path, plan: AssetPlan) -> Path:
    """Write the layers of a finger into a new folder of its name, and return the file to open.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    return write_layers(folder, "new_asset", LAYERS, plan, NUMBER_FILTERS)
