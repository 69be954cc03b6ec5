"""Where links may meet obstacles, and each other, as kernels know it: what is fixed in code."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

# Shapes of obstacles; the device code knows them by their places here
SHAPES = ("sphere", "box", "plane")
LINK_SHAPE = len(SHAPES)  # Stands for the shape of an obstacle that is a link's capsule
# Where on a capsule a contact is: at an end of its axis, or wherever it comes closest
START, END, BETWEEN = 0, 1, 2
# A flat face is met by both ends of a link that lies on it, an edge by what lies in between
PLACES = {"sphere": (BETWEEN,), "box": (START, END, BETWEEN), "plane": (START, END)}
STRETCH = 3  # Numbers of memory per contact: how far friction has stretched it, a vector
# Stands for capsule and link of a contact between a free body and a fixed obstacle, and for those
# of an obstacle that is none
NO_LINK = -1
# Corners of a box. A box meets a flat face with each of them by itself.
CORNERS = 8
# Where a ball meets something; behind the corners of a free box and those of a fixed one
CENTRE = 2 * CORNERS
# Where a free body of a shape may meet fixed obstacles of each
REST_PLACES = {
    "sphere": dict.fromkeys(SHAPES, (CENTRE,)),
    "box": {"sphere": (CENTRE,), "box": tuple(range(2 * CORNERS)), "plane": tuple(range(CORNERS))},
}
FIXED = -1  # Stands for the free body where there is none
BODY_COORDINATES = 6  # Coordinates of a free body: a way, then a turn


@dataclass(frozen=True, kw_only=True)
class ContactPlan:
    """Which capsules of a world may meet which obstacles, and where."""

    links: tuple[int, ...]  # Link that carries each capsule, shape (C,)
    shapes: tuple[str, ...]  # Shape of each obstacle, shape (O,); "capsule" of a link
    body: int = FIXED  # The obstacle that is free to move
    chains: int = 1  # Equal chains of a world, which meet the same obstacles
    # Contacts between links; see `LinkContactPlan`
    pairs: ClassVar[tuple[tuple[int, int], ...]] = ()

    @property
    def moves(self) -> bool:
        """Whether an obstacle is free to move."""
        return self.body != FIXED

    @cached_property
    def contacts(self) -> tuple[tuple[int, int, int, int, int], ...]:
        """What each contact that may be is: capsule, obstacle, place, the obstacle's shape, link.

        The place is on the capsule; the link carries it. Behind them stand those of a free body
        with fixed obstacles.
        """
        pressed = tuple(
            (capsule, obstacle, place, SHAPES.index(shape), link)
            for capsule, link in enumerate(self.links)
            for obstacle, shape in enumerate(self.shapes)
            for place in PLACES.get(shape, ())
        )
        return pressed + self._met + self._rests

    @property
    def _met(self) -> tuple[tuple[int, int, int, int, int], ...]:
        """Contacts of links with links."""
        return tuple(
            (capsule, obstacle, BETWEEN, LINK_SHAPE, self.links[capsule])
            for capsule, obstacle in self.pairs
        )

    @property
    def _rests(self) -> tuple[tuple[int, int, int, int, int], ...]:
        """Contacts of a free body with fixed obstacles."""
        if not self.moves:
            return ()
        places = REST_PLACES[self.shapes[self.body]]
        return tuple(
            (NO_LINK, obstacle, place, SHAPES.index(shape), NO_LINK)
            for obstacle, shape in enumerate(self.shapes)
            if obstacle != self.body
            for place in places.get(shape, ())
        )

    @property
    def memory_count(self) -> int:
        """Numbers that a world remembers of its contacts."""
        return STRETCH * len(self.contacts)


@dataclass(frozen=True, kw_only=True)
class LinkContactPlan(ContactPlan):
    """Contacts of a mechanism whose links may meet each other.

    A plan without pairs says nothing of them, so that its kernels keep their names.
    """

    # Capsule that each obstacle is, `NO_LINK` of one that is no link, shape (O,)
    capsules: tuple[int, ...]
    # Capsule and obstacle of each contact between links
    pairs: tuple[tuple[int, int], ...]  # pyright: ignore[reportIncompatibleVariableOverride]


NO_CONTACTS = ContactPlan(links=(), shapes=())  # A mechanism with nothing in its way
