"""Obstacles of a mechanism: nothing, a roll of tape, a hand that holds it or comes and goes."""

import random
from dataclasses import dataclass

from tendon_newton.errors import unknown_name


@dataclass(frozen=True, kw_only=True, slots=True)
class ObstacleGrip:
    """Time and place of one stay of an obstacle on the tendon's path."""

    start: float  # Instant at which it arrives [s]
    end: float  # Instant at which it leaves [s]
    # Excursion of the tendon at which it is met, as an angle of the nominal spool [rad]
    place: float
    stiffness: float  # At the tendon [N/m]
    damping: float  # At the tendon [N s/m]


FOREVER = 1e9  # [s]
NOMINAL_SPOOL = 0.0125  # [m]
TAPE_ROLL = ObstacleGrip(start=0.0, end=FOREVER, place=0.87, stiffness=3000.0, damping=20.0)
"""Met at half closure: half of the finger's 1.736 rad."""
HAND = ObstacleGrip(start=0.0, end=FOREVER, place=0.0, stiffness=900.0, damping=15.0)
"""Blocks from the start; flesh is softer than tape."""
HAND_STAYS = 3600.0  # Time for which a perturbing hand comes and goes [s]
OBSTACLES = ("free", "tape_roll", "hand", "hand_perturbation")


def grips(name: str, seed: int) -> tuple[ObstacleGrip, ...]:
    """Return an obstacle's stays.

    A perturbing hand comes about every 2.5 s for 0.3 to 1.2 s, at a drawn place with a drawn
    firmness; the same seed gives the same hand.

    Raises:
        UnknownName: No such obstacle; the message lists the known ones.
    """
    if name not in OBSTACLES:
        raise unknown_name("obstacle", name, OBSTACLES)
    if name == "free":
        return ()
    if name == "tape_roll":
        return (TAPE_ROLL,)
    if name == "hand":
        return (HAND,)
    rng, time = random.Random(f"hand {seed}"), 0.0
    stays: list[ObstacleGrip] = []
    while time < HAND_STAYS:
        time += rng.expovariate(1.0 / 1.7) + 0.3
        length = rng.uniform(0.3, 1.2)
        stays.append(
            ObstacleGrip(
                start=time,
                end=time + length,
                place=rng.uniform(0.15, 1.1),
                stiffness=rng.uniform(400.0, 1500.0),
                damping=15.0,
            )
        )
        time += length
    return tuple(stays)


class BenchObstacle:
    """The stay that holds now; it comes and goes over a tenth of a second, as a hand does."""

    __slots__ = ("_grips", "_next", "now")

    APPROACH = 0.1  # [s]

    def __init__(self, stays: tuple[ObstacleGrip, ...] = ()) -> None:
        self._grips = stays
        self._next = 0
        self.now: ObstacleGrip | None = None

    def advance(self, time: float) -> None:
        """Find the stay at an instant [s]; instants never go back."""
        while self._next < len(self._grips) and self._grips[self._next].end <= time:
            self._next += 1
        stay = self._grips[self._next] if self._next < len(self._grips) else None
        self.now = stay if stay is not None and stay.start <= time else None

    def push(self, excursion: float, rate: float, time: float) -> float:
        """Return how hard it pushes the tendon out [N], never below zero."""
        stay = self.now
        if stay is None:
            return 0.0
        depth = excursion - stay.place * NOMINAL_SPOOL
        if depth <= 0.0:
            return 0.0
        rise = min(1.0, (time - stay.start) / self.APPROACH, (stay.end - time) / self.APPROACH)
        if stay.start <= 0.0:
            rise = 1.0
        force = rise * (stay.stiffness * depth + stay.damping * rate)
        return force if force > 0.0 else 0.0
