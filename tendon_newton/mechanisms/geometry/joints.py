"""One degree of freedom and the link that it moves."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset

JointKind = Literal["revolute", "prismatic"]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """One degree of freedom and the link that it moves.

    Units are those of a revolute joint; for a prismatic one read N for N m and m for rad.
    """

    name: str  # Last element of its prim's path
    prim: str  # Path of its prim in the asset
    kind: JointKind
    parent: int  # Joint that moves the link this joint sits on, or -1 for the base
    axis: Array  # Unit axis in the joint frame, shape (3,)
    parent_position: Array  # Joint frame's origin in the parent link [m], shape (3,)
    parent_rotation: Array  # Rotation matrix from the joint frame to the parent link, shape (3, 3)
    child_position: Array  # Joint frame's origin in the own link [m], shape (3,)
    child_rotation: Array  # Rotation matrix from the joint frame to the own link, shape (3, 3)
    limits: tuple[float, float]  # Ends of its range [rad]; infinite where there is no stop
    stop_stiffness: float  # Stiffness of the end stops [N m/rad]
    stop_damping: float  # Damping of the end stops [N m s/rad]
    stiffness: float  # Stiffness of the return spring [N m/rad]
    rest: float  # Position at which the return spring is relaxed [rad]
    damping: float  # Viscous damping [N m s/rad]
    friction: float  # Dry friction [N m]
    mass: float  # Mass of the link, arm included [kg]
    center_of_mass: Array  # Centre of mass in the link's frame [m], shape (3,)
    inertia: Array  # Inertia about the centre of mass [kg m^2], shape (3, 3)
    # From the joint to the next joint or the tip [m]; None where there is neither
    length: float | None
    # Part of the link's mass that is an even arm from the joint to the rest of it [kg]
    arm_mass: float = 0.0

    @property
    def body(self) -> tuple[Array, Array, Array]:
        """Mass (), centre from the joint (3,) and inertia (3, 3) of the link."""
        return np.array(self.mass), self.center_of_mass - self.child_position, self.inertia

    def __post_init__(self) -> None:
        freeze_arrays(self)
        if self.mass <= 0.0:
            raise InvalidAsset(f"{self.prim} moves a mass of {self.mass:g} kg; it must be > 0.")
        if not self.limits[0] < self.limits[1]:
            raise InvalidAsset(
                f"{self.prim} has the range [{self.limits[0]:g}, {self.limits[1]:g}]; "
                "its lower end must be below its upper end."
            )


class ReadOnlyArrays:
    """What a frozen dataclass inherits to have read-only copies of its arrays."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def freeze_arrays(instance: object) -> None:
    """Make the arrays of a frozen dataclass read-only copies."""
    for name, value in vars(instance).items():
        if isinstance(value, np.ndarray):
            own = np.array(value, dtype=bool if value.dtype == bool else np.float64)
            own.setflags(write=False)
            object.__setattr__(instance, name, own)
