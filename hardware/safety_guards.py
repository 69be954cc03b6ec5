"""The rules of a deployment applied to every servo of a bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hardware.safety import (
    COMMON_RULES,
    HARDNESS,
    SAFETY_RULES,
    Glance,
    Mode,
    SafetyGuard,
    Trip,
)
from hardware.safety_limits import DeployLimits


class SafetyGuards:
    """Applies the rules to each servo; what one of them breaks acts on all.

    Args:
        limits: The numbers of the table, of each servo.
        names: What the reasons call the servos.
    """

    def __init__(self, limits: Sequence[DeployLimits], names: Sequence[str]) -> None:
        own = tuple(rule for rule in SAFETY_RULES if rule.name not in COMMON_RULES)
        first, *others = limits
        self._guards = [SafetyGuard(first), *(SafetyGuard(each, own) for each in others)]
        self._names = tuple(names)

    @property
    def mode(self) -> Mode:
        """What the loop must do now with all servos."""
        return max((guard.mode for guard in self._guards), key=HARDNESS.__getitem__)

    @property
    def trips(self) -> dict[str, int]:
        """How often each rule came into effect, for any of the servos."""
        total: dict[str, int] = {}
        for guard in self._guards:
            for name, count in guard.trips.items():
                total[name] = total.get(name, 0) + count
        return total

    def judge(self, glances: Sequence[Glance]) -> list[Trip]:
        """Look once at each servo; return the rules that come into effect now."""
        trips: list[Trip] = []
        for place, (guard, glance) in enumerate(zip(self._guards, glances, strict=True)):
            trips += (self._told(trip, place) for trip in guard.judge(glance))
        return trips

    def _told(self, trip: Trip, place: int) -> Trip:
        """Return a trip that says which of several servos it is about."""
        if len(self._guards) == 1 or trip.rule.name in COMMON_RULES:
            return trip
        return replace(trip, servo=place, reason=f"{self._names[place]}: {trip.reason}")
