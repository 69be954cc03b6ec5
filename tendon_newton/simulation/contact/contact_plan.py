"""Where links may meet obstacles, as kernels know it: what is fixed in code."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

SHAPES = ("sphere", "box", "plane")
"""Shapes of obstacles; the device code knows them by their places here."""
START, END, BETWEEN = 0, 1, 2
"""Where on a capsule a contact is: at an end of its axis, or wherever it comes closest."""
PLACES = {"sphere": (BETWEEN,), "box": (START, END, BETWEEN), "plane": (START, END)}
"""A flat face is met by both ends of a link that lies on it, an edge by what lies in between."""
STRETCH = 3
"""Numbers of memory per contact: how far friction has stretched it, a vector."""


@dataclass(frozen=True, kw_only=True)
class ContactPlan:
    """Which capsules of a world may meet which obstacles, and where."""

    links: tuple[int, ...]
    """Link that carries each capsule, shape (C,)."""
    shapes: tuple[str, ...]
    """Shape of each obstacle, shape (O,)."""

    @cached_property
    def contacts(self) -> tuple[tuple[int, int, int, int, int], ...]:
        """What each contact that may be is: capsule, obstacle, place, the obstacle's shape, link.

        The place is on the capsule; the link carries it.
        """
        return tuple(
            (capsule, obstacle, place, SHAPES.index(shape), link)
            for capsule, link in enumerate(self.links)
            for obstacle, shape in enumerate(self.shapes)
            for place in PLACES[shape]
        )

    @property
    def memory_count(self) -> int:
        """Numbers that a world remembers of its contacts."""
        return STRETCH * len(self.contacts)


NO_CONTACTS = ContactPlan(links=(), shapes=())
"""A mechanism with nothing in its way."""
