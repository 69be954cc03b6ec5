"""Things in a mechanism's way: shapes of its base, a body free to move, its own links."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import ClassVar, Literal

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.joints import freeze_arrays

ObstacleShape = Literal["sphere", "box", "plane", "capsule"]

STIFFNESS = 5.0e3
"""Default of `stiffness` [N/m].

That of a human fingertip under some newtons, measured as 1 to 10 N/mm. Source: Pawluk and Howe,
Dynamic lumped element response of the human fingerpad, J. Biomech. Eng. 121 (1999).
"""
# Default of `dissipation` [s/m]: at 0.1 m/s nothing bounces, as with skin or rubber
DISSIPATION = 10.0
FRICTION = 0.5  # Default of `friction` [1]
NOT_NEGATIVE = ("stiffness", "dissipation", "friction")


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    r"""Something that links press against, and what the contact is like.

    It is fixed to the base, or free to move if it has a mass.

    With :math:`\delta` the depth to which a link overlaps it, the link is pushed off with the
    force :math:`k \delta (1 + \chi \dot\delta)`, and never pulled. Source: Hunt and Crossley,
    Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975), with
    the exponent 1 of a layer of skin.
    """

    shape: ClassVar[ObstacleShape]

    position: Array  # Centre, or a point of a plane, in the base frame [m], shape (3,)
    stiffness: float = STIFFNESS  # Force per depth, k [N/m]; 0 removes the obstacle
    dissipation: float = DISSIPATION  # Rise of the force with the closing speed, chi [s/m]
    friction: float = FRICTION  # Coulomb's coefficient [1]
    mass: float | None = None  # Mass of a solid that is free to move [kg]; None: fixed to the base

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        self._require_finite(entry.name for entry in fields(self))
        self._require_vector("position")
        self._require_not_negative()
        if self.mass is not None and not self.mass > 0.0:
            raise InvalidParameter(
                f"mass of a {self.shape} that moves must be positive; it is {self.mass} kg"
            )
        freeze_arrays(self)

    @property
    def inertia(self) -> Array:
        """Inertia about its own axes where it has a mass [kg m2], shape (3,)."""
        return np.zeros(3)

    @property
    def size(self) -> Array:
        """What tells large from small [m], shape (3,), as the kernels read it."""
        return np.zeros(3)

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its own axes to the base frame, shape (3, 3)."""
        return np.eye(3)

    def _require_finite(self, names: Iterable[str]) -> None:
        """Refuse numbers that are none."""
        for name in names:
            if getattr(self, name) is None:
                continue
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if not np.isfinite(values).all():
                raise InvalidParameter(
                    f"{name} of a {self.shape} must be finite; it is {values.tolist()}"
                )

    def _require_not_negative(self) -> None:
        """Refuse a contact that would pull or drive."""
        for name in NOT_NEGATIVE:
            if not getattr(self, name) >= 0.0:
                raise InvalidParameter(
                    f"{name} of a {self.shape} must not be negative; it is {getattr(self, name)}"
                )

    def _require_vector(self, name: str) -> None:
        """Refuse what is no vector of space, and keep one as an array."""
        value = np.asarray(getattr(self, name), dtype=np.float64)
        if value.shape != (3,):
            raise InvalidParameter(
                f"{name} of a {self.shape} must have 3 components; it has the shape {value.shape}"
            )
        object.__setattr__(self, name, value)


@dataclass(frozen=True, kw_only=True)
class Sphere(Obstacle):
    """A ball."""

    shape: ClassVar[ObstacleShape] = "sphere"

    radius: float  # [m]

    def __post_init__(self) -> None:
        """Refuse a ball without a size."""
        super().__post_init__()
        if not self.radius > 0.0:
            raise InvalidParameter(f"radius of a sphere must be positive; it is {self.radius} m")

    @property
    def inertia(self) -> Array:
        """That of a solid ball [kg m2], shape (3,)."""
        return np.full(3, 0.4 * (self.mass or 0.0) * self.radius**2)

    @property
    def size(self) -> Array:
        """The radius, three times [m], shape (3,)."""
        return np.full(3, self.radius)


@dataclass(frozen=True, kw_only=True)
class Box(Obstacle):
    """A box."""

    shape: ClassVar[ObstacleShape] = "box"

    half_size: Array  # Half of its edges [m], shape (3,)
    # Rotation matrix from the edges to the base frame, shape (3, 3); along its axes by default
    turn: Array | None = None

    def __post_init__(self) -> None:
        """Refuse a box without a size, and a turn that is no rotation."""
        if self.turn is None:
            object.__setattr__(self, "turn", np.eye(3))
        super().__post_init__()
        self._require_vector("half_size")
        if not np.min(self.half_size) > 0.0:
            raise InvalidParameter(
                f"half_size of a box must be positive; it is {self.half_size.tolist()} m"
            )
        turn = np.asarray(self.turn, dtype=np.float64)
        if turn.shape != (3, 3) or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-6):
            raise InvalidParameter(
                f"turn of a box must be a rotation matrix, shape (3, 3); it is {turn.tolist()}"
            )
        freeze_arrays(self)

    @property
    def inertia(self) -> Array:
        """That of a solid box [kg m2], shape (3,)."""
        squares = np.square(self.half_size)
        return (self.mass or 0.0) / 3.0 * (np.sum(squares) - squares)

    @property
    def size(self) -> Array:
        """Half of the edges [m], shape (3,)."""
        return self.half_size

    @property
    def rotation(self) -> Array:
        """Rotation matrix from the edges to the base frame, shape (3, 3)."""
        assert self.turn is not None
        return self.turn


@dataclass(frozen=True, kw_only=True)
class Plane(Obstacle):
    """Everything on one side of a plane."""

    shape: ClassVar[ObstacleShape] = "plane"

    normal: Array  # Direction away from the solid, shape (3,); its length does not matter

    def __post_init__(self) -> None:
        """Refuse a normal without a direction, and a plane that moves."""
        super().__post_init__()
        if self.mass is not None:
            raise InvalidParameter(
                f"a plane has no end and cannot move; its mass must be None, it is {self.mass} kg"
            )
        self._require_vector("normal")
        length = float(np.linalg.norm(self.normal))
        if not length > 1.0e-9:
            raise InvalidParameter(
                f"normal of a plane must have a direction; it is {self.normal.tolist()}"
            )
        object.__setattr__(self, "normal", self.normal / length)
        freeze_arrays(self)

    @property
    def rotation(self) -> Array:
        """Rotation matrix whose third column is the normal, shape (3, 3)."""
        helper = np.eye(3)[int(np.argmin(np.abs(self.normal)))]
        first = np.cross(helper, self.normal)
        first /= np.linalg.norm(first)
        return np.column_stack([first, np.cross(self.normal, first), self.normal])


@dataclass(frozen=True, kw_only=True)
class LinkObstacle(Obstacle):
    """A link of the mechanism itself, which links of other fingers press against.

    The link's capsule is the obstacle, and the contact pushes the link back as hard.
    """

    shape: ClassVar[ObstacleShape] = "capsule"

    # End of the link's path in the asset, such as ``index/distal_phalanx``; that of a capsule's
    # path where the link carries several
    link: str
    # Ends of the paths of links that may press against it; by default all of other fingers
    met_by: Sequence[str] = ()
    # Unused: its joints place it [m], shape (3,)
    position: Array = field(init=False, default_factory=lambda: np.zeros(3))
    mass: float | None = field(init=False, default=None)  # Unused: its mass is the asset's [kg]

    def __post_init__(self) -> None:
        """Refuse a contact that cannot be."""
        object.__setattr__(self, "met_by", tuple(self.met_by))
        self._require_finite(NOT_NEGATIVE)
        self._require_not_negative()
        freeze_arrays(self)
