"""What a policy may not do: a table of rules, and the guard that applies it every tick.

Each rule says what it looks at, the limit, how long that must be passed, what happens then and why.
Actions, from mild to hard, of which the hardest wins:

- ``cut``: the command is cut to the limit and the policy goes on;
- ``hold``: the last command stays until the cause is gone; what is not gone after the rule's
  patience is unwound;
- ``unwind``: the tendon is let out slowly to home, then the motor is off and the run is over;
- ``off``: the motor is switched off at once and the run is over.

Whatever happens to this program itself is the servo's business: its bus watchdog stops the motor
when no instruction comes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from hardware.safety_limits import DeployLimits

Action = Literal["cut", "hold", "unwind", "off"]
Mode = Literal["run", "hold", "unwind", "off"]
HARDNESS: dict[str, int] = {"run": 0, "cut": 0, "hold": 1, "unwind": 2, "off": 3}
UNLIMITED = float("inf")


@dataclass(frozen=True, kw_only=True, slots=True)
class Glance:
    """What is known in one tick; ``None`` where nothing is."""

    now: float
    """Instant on the bench's clock [s]."""
    position: float | None = None
    """Spool angle [rad]."""
    silence: float = 0.0
    """Time since the servo's last reading [s]."""
    force: float | None = None
    """Tension, measured or estimated [N]."""
    blindness: float | None = None
    """Time since the load cell's last reading [s]."""
    current: float | None = None
    """Supply current [A]."""
    voltage: float | None = None
    """Supply voltage [V]."""
    temperature: float | None = None
    """Of the motor [degC]."""
    stopped: str | None = None
    """Why the servo does not drive: an alert, a restart, its watchdog."""
    skipped: int = 0
    """Ticks lately skipped because this computer was busy."""
    output: float | None = None
    """What the policy wants [rad], maybe no number."""
    jump: float = 0.0
    """Speed at which the command would change [rad/s]."""
    stop: str | None = None
    """Who wants an orderly end."""
    kill: str | None = None
    """Who wants the motor off at once."""
    failure: str | None = None
    """Why the log cannot be written."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyRule:
    """One row of the table."""

    name: str
    value: Callable[[Glance], float | None]
    """What is looked at; ``None`` where it is not known, and then not judged."""
    bounds: Callable[[DeployLimits], tuple[float, float]]
    """Least and greatest value that is safe."""
    action: Action
    reason: str
    """Said and logged; ``value``, ``low``, ``high`` and ``glance`` are filled in."""
    delay: float = 0.0
    """How long a limit must be passed before anything happens [s]."""
    patience: float = UNLIMITED
    """How long a hold may last before the tendon is unwound [s]."""


def said(text: str | None) -> float:
    """Return 1 where something was said."""
    return float(text is not None)


SAFETY_RULES: tuple[SafetyRule, ...] = (
    SafetyRule(
        name="kill", action="off", value=lambda g: said(g.kill), bounds=lambda _: (0.0, 0.0),
        reason="{glance.kill}",
    ),
    SafetyRule(
        name="servo_stopped", action="off", value=lambda g: said(g.stopped),
        bounds=lambda _: (0.0, 0.0), reason="{glance.stopped}",
    ),
    SafetyRule(
        name="position_window", action="off", value=lambda g: g.position,
        bounds=lambda limits: limits.position,
        reason="the spool must stay within {low:.2f} to {high:.2f} rad from home; it is at "
        "{value:.2f} rad: is the tendon still fixed?",
    ),
    SafetyRule(
        name="voltage", action="off", value=lambda g: g.voltage,
        bounds=lambda limits: limits.voltage,
        reason="the supply must have {low:g} to {high:g} V; it has {value:.1f} V",
    ),
    SafetyRule(
        name="servo_lost", action="off", value=lambda g: g.silence,
        bounds=lambda limits: (0.0, limits.silence),
        reason="the servo must answer; it has been silent for {value:.2f} s: see that its motor "
        "is off",
    ),
    SafetyRule(
        name="operator", action="unwind", value=lambda g: said(g.stop),
        bounds=lambda _: (0.0, 0.0), reason="{glance.stop}",
    ),
    SafetyRule(
        name="tension", action="unwind", value=lambda g: g.force,
        bounds=lambda limits: (-limits.force, limits.force),
        reason="the tension must stay below {high:g} N; it is {value:.1f} N",
    ),
    SafetyRule(
        name="current", action="unwind", value=lambda g: g.current, delay=0.03,
        bounds=lambda limits: (-limits.current, limits.current),
        reason="the current must stay below {high:g} A; it is {value:.2f} A",
    ),
    SafetyRule(
        name="temperature", action="unwind", value=lambda g: g.temperature,
        bounds=lambda limits: (-UNLIMITED, limits.temperature),
        reason="the motor must stay below {high:g} degC; it has {value:.0f}: let it cool",
    ),
    SafetyRule(
        name="log", action="unwind", value=lambda g: said(g.failure),
        bounds=lambda _: (0.0, 0.0), reason="{glance.failure}",
    ),
    SafetyRule(
        name="missed_reads", action="hold", value=lambda g: g.silence,
        bounds=lambda limits: (0.0, limits.stale_state),
        reason="the position must not be older than {high:g} s; it is {value:.3f} s old",
    ),
    SafetyRule(
        name="stale_force", action="hold", value=lambda g: g.blindness, patience=1.0,
        bounds=lambda limits: (0.0, limits.stale_force),
        reason="the tension must not be older than {high:g} s; it is {value:.2f} s old: look at "
        "the load cell's plug",
    ),
    SafetyRule(
        name="loop_overrun", action="hold", value=lambda g: float(g.skipped), patience=1.0,
        bounds=lambda limits: (0.0, float(limits.skipped_ticks)),
        reason="at most {high:.0f} ticks of eight may be skipped; {value:.0f} were: this computer "
        "is too busy",
    ),
    SafetyRule(
        name="policy_output", action="hold", value=lambda g: g.output, patience=0.5,
        bounds=lambda limits: (-limits.output, limits.output),
        reason="the policy must want an action within {high:g} rad; it wants {value:g}",
    ),
    SafetyRule(
        name="command_rate", action="cut", value=lambda g: g.jump,
        bounds=lambda limits: (-limits.command_rate, limits.command_rate),
        reason="a command may change by {high:g} rad/s; the policy wants {value:.0f}: it is cut",
    ),
)  # fmt: skip
"""What is looked at, from hard to mild. The text in `docs/deployment.md` is made from it."""
COMMON_RULES = ("kill", "operator", "log", "loop_overrun")
"""Those that are about no servo: of several servos the first one's guard applies them."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Trip:
    """A rule that has come into effect."""

    rule: SafetyRule
    action: Action
    """What happens: the rule's own action, or ``unwind`` where a hold has lasted too long."""
    since: float
    """When the limit was first seen passed [s]."""
    instant: float
    """When it was acted upon [s]."""
    reason: str
    servo: int = 0
    """Place of the servo that it is about."""


class SafetyGuard:
    """Applies the rules; a run that is being unwound or is off never goes back.

    Args:
        limits: The numbers of the table.
        rules: The table.
    """

    def __init__(self, limits: DeployLimits, rules: tuple[SafetyRule, ...] = SAFETY_RULES) -> None:
        self.limits = limits
        self.mode: Mode = "run"
        """What the loop must do now."""
        self.trips: dict[str, int] = {}
        """How often each rule came into effect."""
        self._rules = [(rule, rule.bounds(limits)) for rule in rules]
        self._since: dict[str, float] = {}
        self._tripped: dict[str, float] = {}

    def judge(self, glance: Glance) -> list[Trip]:
        """Look once; return the rules that come into effect now."""
        trips = []
        mildest: Mode = self.mode if self.mode in ("unwind", "off") else "run"
        for rule, (low, high) in self._rules:
            value = rule.value(glance)
            if value is None or low <= value <= high:  # no number lies within no bounds
                self._since.pop(rule.name, None)
                self._tripped.pop(rule.name, None)
                continue
            since = self._since.setdefault(rule.name, glance.now)
            if glance.now - since < rule.delay:
                continue
            action = self._action(rule, glance.now)
            if HARDNESS[action] > HARDNESS[mildest]:
                mildest = action  # pyright: ignore[reportAssignmentType]  # a cut is not harder
            if rule.name not in self._tripped or action != rule.action:
                trips += self._trip(rule, action, glance, (value, low, high))
        self.mode = mildest
        return trips

    def _action(self, rule: SafetyRule, now: float) -> Action:
        """Return what a broken rule asks for: a hold does not last for ever."""
        held = now - self._tripped.get(rule.name, now)
        return "unwind" if rule.action == "hold" and held > rule.patience else rule.action

    def _trip(
        self, rule: SafetyRule, action: Action, glance: Glance, numbers: tuple[float, float, float]
    ) -> list[Trip]:
        """Enter a rule that comes into effect; what ends a run comes into effect once."""
        if action != rule.action and HARDNESS[self.mode] >= HARDNESS[action]:
            return []
        self._tripped.setdefault(rule.name, glance.now)
        self.trips[rule.name] = self.trips.get(rule.name, 0) + 1
        value, low, high = numbers
        reason = rule.reason.format(value=value, low=low, high=high, glance=glance)
        return [
            Trip(
                rule=rule, action=action, since=self._since[rule.name], instant=glance.now,
                reason=reason,
            )
        ]  # fmt: skip
