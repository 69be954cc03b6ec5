"""Types and constants of the device templates, with what a reader and a type checker may assume.

`Specialiser` replaces each of them: `real` by float32 or float64, the vectors by their sizes in the
mechanism at hand. `structs` declares what is made of them, `slots` the functions.
"""

from typing import TYPE_CHECKING, Any, Generic, TypeVar

import warp as wp

if TYPE_CHECKING:
    Item = TypeVar("Item")

    class DeviceArray(Generic[Item]):
        """An array argument of a kernel; Warp's own stub does not know what an index gives."""

        shape: tuple[int, ...]

        def __getitem__(self, index: Any) -> Item: ...
        def __setitem__(self, index: Any, value: Item) -> None: ...

    DeviceGrid = DeviceArray
    DeviceBlock = DeviceArray
else:
    DeviceArray = wp.array
    DeviceGrid = wp.array2d
    DeviceBlock = wp.array3d


class Placeholder(Any):
    """Stands for a type that only a `Specialiser` knows; a type checker lets it do anything."""


class real(Placeholder):  # noqa: N801 - a scalar, as `float` is
    """Scalar of the simulation."""


class Flags(Placeholder):
    """Whole number of 64 bits, each of which says yes or no."""


class Vec2(Placeholder):
    """Vector of a plane."""


class Vec3(Placeholder):
    """Vector of space."""


class Mat33(Placeholder):
    """Matrix of space, shape (3, 3)."""


class Quaternion(Placeholder):
    """Turn from a body's own axes to the base, (x, y, z, w)."""


class Place(Placeholder):
    """Vector of the space in which the chain moves: `Vec2` in a plane, else `Vec3`."""


class LinkInertia(Placeholder):
    """Inertia of a link [kg m2]: `real` about the normal of a plane, else `Mat33`."""


class Jet(Placeholder):
    """Value and derivatives by position and velocity of a force [N], torque [N m] or angle [rad].

    A tendon's jet is differentiated by the string that is wound in, l [m], and its rate [m/s]; a
    joint's by the joint's position [rad, m] and velocity. Sums, differences and multiples of jets
    carry the derivatives along.
    """


class Values(Placeholder):
    """An effect's own parameters in the order of its declaration, padded with zeros to three.

    `values[3]` is what the effect remembers, `values[4]` the second of two such numbers.
    """


class Owner(Placeholder):
    """Struct of the tendon or the joint that a stage is about."""


class MemoryVector(Placeholder):
    """What a world remembers, one number per tendon or joint of each effect that does, (S,)."""


class JointVector(Placeholder):
    """One number per coordinate, shape (J,): the joints, then spools that move on their own."""


class JointMatrix(Placeholder):
    """Shape (J, J)."""


class LinkMatrix(Placeholder):
    """One number per pair of joints that carry links, shape (L, L)."""


class PlaneMatrix(Placeholder):
    """One vector of the plane of motion per joint, shape (J, 2)."""


class SpaceMatrix(Placeholder):
    """One vector of space per joint, shape (J, 3)."""


class TurnMatrix(Placeholder):
    """One rotation of space per joint, shape (3 J, 3)."""


class CapsuleMatrix(Placeholder):
    """One vector of space per capsule, shape (C, 3)."""


class TendonVector(Placeholder):
    """One number per tendon, shape (D,)."""


class TendonRows(Placeholder):
    """One row of a recording per tendon, shape (D,)."""


class ArmMatrix(Placeholder):
    """Moment arms [m] or [1], shape (D, J)."""


class BendMatrix(Placeholder):
    """Second derivatives of the tendons' excursions by the joints of L links, shape (D L, L)."""


class WayVector(Placeholder):
    """Place of each joint on the way to an end of a span, shape (J,); see `routes`."""


class RowVector(Placeholder):
    """One number per row in which dry friction may hold a tendon, shape (R,).

    First the rows of the spools; where spools have coordinates of their own, then those of the
    strings in their guides.
    """


class RowMatrix(Placeholder):
    """Directions of these rows among the coordinates [m] or [1], shape (R, J)."""


class ParameterVector(Placeholder):
    """The actuator's parameters, then each effect's, then two zeros, shape (P,)."""


class Constant:
    """Stands for a number or a table that only a `Specialiser` knows."""


def constant() -> Any:
    """Declare a constant; its declaration says of which type it is."""
    return Constant()


JOINTS: int = constant()  # Number of coordinates J
# Number of the mechanism's own joints; J counts the spools that have a coordinate as well
LINKS: int = constant()
TENDONS: int = constant()  # Number of tendons D
ROWS: int = constant()  # Number of rows R
PARENT: tuple[int, ...] = constant()  # Parent of each coordinate, -1 for the base
REVOLUTE: tuple[bool, ...] = constant()  # Whether each coordinate turns
MOVES: tuple[tuple[bool, ...], ...] = constant()  # Whether coordinate j carries link k
PLANAR: bool = constant()  # Whether the chain moves in one plane
FREE_SPOOL: bool = constant()  # Whether each spool has a coordinate of its own
HAS_ROTOR: bool = constant()  # Whether a rotor's inertia stands between the motor and the load cell
MAY_HOLD: bool = constant()  # Whether any effect of the kernel holds a tendon at a speed
# Whether any effect acts on the share of all it has which a servo gives
HAS_DUTY: bool = constant()
# Where the strengths of the tendons' dry frictions stand among the parameters
DRY_OFFSETS: tuple[int, ...] = constant()
HAS_BRISTLES: bool = constant()  # Whether any effect bends bristles before dry friction slides
# Where the parameters stand with which nothing sticks: bristles bend instead
SMOOTH_OFFSETS: tuple[int, ...] = constant()
REST: float = constant()  # Speed below which a dry friction may stick [m/s, rad/s]
STRIDE: float = constant()  # Longest step towards an equilibrium [rad, m]

FUNCTIONS: tuple[Any, ...] = constant()  # Device functions of the effects of a stage
OFFSETS: tuple[int, ...] = constant()  # Where their parameters start
# How much further those of the next tendon start; 0 where all tendons have the same
STRIDES: tuple[int, ...] = constant()
MEMORIES: tuple[int, ...] = constant()  # Where their memories start, -1 for none
# Where the second of two memories starts, -1 for none
SECOND_MEMORIES: tuple[int, ...] = constant()
PLACES: tuple[int, ...] = constant()  # Where the results of functions that renew a memory start
BITS: tuple[int, ...] = constant()  # Places of these functions in `Drive.asleep`

# Whether effects whose parameters are all null are passed over. A tape asks for their derivatives
# there
SKIPS: bool = constant()
TAPED: bool = constant()  # Whether a tape walks the kernel back
EFFECT_COUNT: int = constant()  # How many it has
FIRST_OWN: int = constant()  # Where the first parameter of an effect stands, behind the actuator's
# For each parameter of the effects, its effect's place in `Drive.asleep`
OWN_BITS: tuple[int, ...] = constant()
OWN_NULLS: tuple[float, ...] = constant()  # Null value of each of these parameters

HAS_MEMORY: bool = constant()  # Whether any effect of the kernel has internal state
MEMORY_SIZE: int = constant()  # Numbers S in a world's memory
# Where the parameters stand that wake the effects with memory, those of each tendon
MEMORY_OFFSETS: tuple[int, ...] = constant()
MEMORY_NULLS: tuple[float, ...] = constant()  # Null values of these parameters
# For each tendon's memory that counts seconds: its place, and that of the time that it counts to
COUNTS: tuple[tuple[int, int], ...] = constant()
HAS_LOAD: bool = constant()  # Whether the load on the joint is an input
LED: bool = constant()  # Whether the shaft's path is an input
# Whether the actuator's force is decided outside the kernel and held
HOLDS_FORCE: bool = constant()
# Where the held forces stand in a world's memory; what each is reckoned from stands behind
HELD_MEMORY: int = constant()
HAS_SLOW_CELL: bool = constant()  # Whether any effect of the kernel makes the load cell late or lag
CELL_MEMORY: int = constant()  # Where the lagging cells' readings stand in a world's memory

ROUTED: bool = constant()  # Whether any tendon's moment arms follow from its path
HOLDS_ROUTED: bool = constant()  # Whether such a tendon may be held at a speed
POINT_BODY: Any = constant()  # Link of each path point, -1 for the base
FIRST_SPAN: tuple[int, ...] = constant()  # First span of each tendon, and the number of all spans
# Start, end and pulley of each span among the path points; -1 for no pulley
SPAN_TABLE: Any = constant()
START_WAY: Any = constant()  # Way from a span's observer to its start; see `routes`
END_WAY: Any = constant()  # Way from a span's observer to its end

TOUCHES: bool = constant()  # Whether links may meet obstacles
CARRIES: Any = constant()  # 1 where a joint carries a link, else 0, shape (J, J)
CONTACTS: int = constant()  # Number of contacts that may be
# Capsule, obstacle, place on the capsule, shape of the obstacle and link of each contact
CONTACT_TABLE: Any = constant()
CONTACT_MEMORY: int = constant()  # Where the contacts' stretches stand in a world's memory
CAPSULES: int = constant()  # Number of capsules C
CAPSULE_LINK: tuple[int, ...] = constant()  # Link that carries each capsule
HAS_SPHERE: bool = constant()  # Whether any obstacle is a sphere
HAS_BOX: bool = constant()  # Whether any obstacle is a box
HAS_PLANE: bool = constant()  # Whether any obstacle is a plane
HAS_PAIRS: bool = constant()  # Whether links may meet links
MET_CAPSULE: Any = constant()  # Capsule that each obstacle is, -1 for one that is no link
MET_LINK: Any = constant()  # Link that carries it
CHAINS: int = constant()  # Equal chains of a world, which meet the same obstacles
HAS_BODY: bool = constant()  # Whether an obstacle is free to move
SHARES_BODY: bool = constant()  # Whether several chains move it
BODY: int = constant()  # Which of the obstacles that is
BODY_SHAPE: int = constant()  # Shape of the free body
# Where its six coordinates begin: how far it has moved [m] and turned [rad] in a step
FIRST_BODY: int = constant()
