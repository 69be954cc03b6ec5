"""The rules of a deployment applied to every servo of a bench."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.safety_rules.rules import (
    COMMON_RULES,
    HARDNESS,
    SAFETY_RULES,
    Action,
    Glance,
    Mode,
    SafetyRule,
)

RECOVERY = 0.1
"""Patience that comes back while a rule is kept, as a share of the patience spent while it is
broken [1]. A rule broken for more than a tenth of the time ends the run in the end."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Trip:
    """A rule that has come into effect."""

    rule: SafetyRule
    # Action that follows: the rule's own, or ``unwind`` where a hold has lasted too long
    action: Action
    since: float  # When the limit was first seen passed [s]
    instant: float  # When it was acted upon [s]
    reason: str
    servo: int = 0  # Place of the servo that it is about


class SafetyGuard:
    """Applies the rules; a run that is being unwound or is off never goes back."""

    def __init__(self, limits: DeployLimits, rules: tuple[SafetyRule, ...] = SAFETY_RULES) -> None:
        self.limits = limits
        self.mode: Mode = "run"  # Hardest action that the loop must take now
        self.trips: dict[str, int] = {}  # Number of times that each rule came into effect
        self._rules = [(rule, rule.bounds(limits)) for rule in rules]
        self._since: dict[str, float] = {}
        self._tripped: set[str] = set()
        self._spent: dict[str, float] = {}
        self._before: float | None = None

    def judge(self, glance: Glance) -> list[Trip]:
        """Look once; return the rules that come into effect now."""
        trips: list[Trip] = []
        mildest: Mode = self.mode if self.mode in ("unwind", "off") else "run"
        passed = 0.0 if self._before is None else glance.now - self._before
        self._before = glance.now
        for rule, (low, high) in self._rules:
            value = rule.value(glance)
            if value is None or low <= value <= high:  # no number lies within no bounds
                self._forgive(rule, passed)
                continue
            since = self._since.setdefault(rule.name, glance.now)
            if glance.now - since < rule.delay:
                continue
            if rule.name in self._tripped:
                self._spent[rule.name] = self._spent.get(rule.name, 0.0) + passed
            action = self._action(rule)
            if HARDNESS[action] > HARDNESS[mildest]:
                mildest = action  # pyright: ignore[reportAssignmentType]  # a cut is not harder
            if rule.name not in self._tripped or action != rule.action:
                trips += self._trip(rule, action, glance, (value, low, high))
        self.mode = mildest
        return trips

    def _forgive(self, rule: SafetyRule, passed: float) -> None:
        """Note that a rule is kept; what was spent of its patience comes back slowly."""
        self._since.pop(rule.name, None)
        self._tripped.discard(rule.name)
        if rule.name in self._spent:
            self._spent[rule.name] = max(self._spent[rule.name] - RECOVERY * passed, 0.0)

    def _action(self, rule: SafetyRule) -> Action:
        """Return what a broken rule asks for: holds do not last for ever, one or many."""
        worn_out = self._spent.get(rule.name, 0.0) > rule.patience
        return "unwind" if rule.action == "hold" and worn_out else rule.action

    def _trip(
        self, rule: SafetyRule, action: Action, glance: Glance, numbers: tuple[float, float, float]
    ) -> list[Trip]:
        """Enter a rule that comes into effect; what ends a run comes into effect once."""
        if action != rule.action and HARDNESS[self.mode] >= HARDNESS[action]:
            return []
        self._tripped.add(rule.name)
        self.trips[rule.name] = self.trips.get(rule.name, 0) + 1
        value, low, high = numbers
        reason = rule.reason.format(value=value, low=low, high=high, glance=glance)
        return [
            Trip(
                rule=rule,
                action=action,
                since=self._since[rule.name],
                instant=glance.now,
                reason=reason,
            )
        ]


class SafetyGuards:
    """Applies the rules to each servo; what one of them breaks acts on all."""

    def __init__(self, limits: Sequence[DeployLimits], names: Sequence[str]) -> None:
        own = tuple(rule for rule in SAFETY_RULES if rule.name not in COMMON_RULES)
        first, *others = limits
        self._guards = [SafetyGuard(first), *(SafetyGuard(each, own) for each in others)]
        self._names = tuple(names)

    @property
    def mode(self) -> Mode:
        """Hardest action that the loop must take now with all servos."""
        return max((guard.mode for guard in self._guards), key=HARDNESS.__getitem__)

    @property
    def trips(self) -> dict[str, int]:
        """Number of times that each rule came into effect, for any of the servos."""
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
