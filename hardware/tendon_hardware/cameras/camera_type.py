"""What a camera tells the rest: where the ball's middle was, and when.

A camera that is plugged into this computer does the same as one behind lines: find the ball in each
frame, and keep what was found until it is asked for.
"""

from dataclasses import dataclass
from typing import Protocol

Place = tuple[float, float, float]
"""Place of the ball's middle, in the axes of the hand's base [m]."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sighting:
    """The ball in one frame."""

    sequence: int
    """Number of the frame since the camera started; it grows."""
    exposed: float
    """Middle of the exposure on the bench's clock [s]."""
    arrived: float
    """When this program could know [s], after `exposed`."""
    place: Place


class Camera(Protocol):
    """A camera that runs by itself and is emptied now and then."""

    def open(self) -> None:
        """Start to look.

        Raises:
            PortUnavailable: The camera is not there.
            PortBusy: Another process holds it.
        """

    def close(self) -> None:
        """Stop to look; more than once does no harm."""

    def drain(self) -> list[Sighting]:
        """Return what was seen since the last call, in order, at once and without ever waiting.

        A frame without a ball gives nothing, and so does a camera that is gone.
        """
        ...
