"""Limits of a policy: the table of rules, which `rules_applied.py` applies every tick.

Each rule says what it looks at, the limit, how far that can be passed at all, for how long it must
be, what happens then and why. A rule whose limit lies beyond what its sensor can say would never
act; it is refused before any motor runs.
Actions, from mild to hard, of which the hardest wins:

- ``cut``: the command is cut to the limit and the policy goes on;
- ``hold``: the last command stays until the cause is gone; what is not gone after the rule's
  patience is unwound;
- ``unwind``: the tendon is let out slowly to home, then the motor is off and the run is over;
- ``off``: the motor is switched off at once and the run is over.

Whatever happens to this program itself is the servo's business: its bus watchdog stops the motor
when no instruction comes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Literal

from tendon_hardware.benches.bench import BenchDrive
from tendon_hardware.errors import RuleOutOfReach, SafetyStop
from tendon_hardware.load_cells.load_cell_type import SATURATED_COUNTS
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.force_estimate import ForceEstimate
from tendon_hardware.safety_rules.rule_limits import SKIP_WINDOW, DeployLimits

Range = tuple[float, float]  # Least and greatest value


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorReach:
    """Ranges of what one servo and the load cell in its tendon can say."""

    position: Range  # Angles of the spool that its register can hold [rad]
    voltage: Range  # Voltages of the supply that its register can hold [V]
    current: Range  # Supply current [A]: a motor takes no more than at standstill
    # Temperature of the motor [degC]: beyond it the servo has switched itself off
    temperature: Range
    # Tension [N]: up to where the load cell saturates, or the estimate is cut; none where
    # nothing tells it
    force: Range | None


def reach_of(drive: BenchDrive, estimate: ForceEstimate | None = None) -> SensorReach:
    """Return what can be said of one servo and its tendon."""
    spec, table = drive.servo.spec, drive.servo.table
    turns = inf  # followed by the driver
    if table.counts_turns:
        turns = 2.0 ** (8 * table.position.size - 1) * spec.position_unit
    return SensorReach(
        position=(-turns, turns),
        voltage=(0.0, (2.0 ** (8 * table.voltage.size) - 1.0) * spec.voltage_unit),
        current=(-spec.stall_current, spec.stall_current),
        temperature=(-inf, spec.temperature_limit),
        force=force_reach(drive, estimate),
    )


def force_reach(drive: BenchDrive, estimate: ForceEstimate | None) -> Range | None:
    """Return the tensions that a load cell, or in its place a network, can tell [N]."""
    if drive.load_cell is not None and drive.calibration is not None:
        ends = [float(drive.calibration.force(counts)) for counts in SATURATED_COUNTS]
        return (0.0, max(ends))
    return None if estimate is None else (0.0, estimate.card.force_limit)


Action = Literal["cut", "hold", "unwind", "off"]
Mode = Literal["run", "hold", "unwind", "off"]
HARDNESS: dict[str, int] = {"run": 0, "cut": 0, "hold": 1, "unwind": 2, "off": 3}
UNLIMITED = float("inf")
Bounds = Callable[[DeployLimits], tuple[float, float]]


@dataclass(frozen=True, kw_only=True, slots=True)
class Glance:
    """What is known in one tick; ``None`` where nothing is."""

    now: float  # Instant on the bench's clock [s]
    position: float | None = None  # Spool angle [rad]
    # How far the spool has moved beyond what its motor can have made [rad]
    strayed: float | None = None
    disobeyed: float | None = None  # Difference of present and sent duty [1]
    stuck: str | None = None  # Reason not to believe the encoder
    silence: float = 0.0  # Time since the servo's last reading [s]
    force: float | None = None  # Tension, measured or estimated [N]
    # Tension that the motor likely makes, where the load cell tells far less [N]
    pull: float | None = None
    blindness: float | None = None  # Time since the load cell's last reading [s]
    doubt: str | None = None  # Reason not to believe the load cell
    current: float | None = None  # Supply current [A]
    voltage: float | None = None  # Supply voltage [V]
    temperature: float | None = None  # Temperature of the motor [degC]
    # Reason why the servo does not drive: an alert, a restart, its watchdog
    stopped: str | None = None
    skipped: int = 0  # Ticks lately skipped because this computer was busy
    output: float | None = None  # Action of the policy [rad], maybe no number
    jump: float = 0.0  # Speed at which the command would change [rad/s]
    stop: str | None = None  # Source of a request for an orderly end
    kill: str | None = None  # Source of a request to switch the motor off at once
    failure: str | None = None  # Reason why the log cannot be written
    broken: str | None = None  # Reason why the policy cannot decide


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyRule:
    """Condition, patience, action and reason: a row of the table."""

    name: str
    # What is looked at; ``None`` where it is not known, and then not judged
    value: Callable[[Glance], float | None]
    bounds: Bounds  # Least and greatest value that is safe
    # Least and greatest value that there can be; ``None`` where nothing tells it
    reach: Callable[[SensorReach], tuple[float, float] | None]
    action: Action
    reason: str  # Said and logged; ``value``, ``low``, ``high`` and ``glance`` are filled in
    delay: float = 0.0  # Time for which a limit must be passed before the rule acts [s]
    patience: float = UNLIMITED  # Time that a hold may last before the tendon is unwound [s]


def lasting(_: SensorReach) -> tuple[float, float]:
    """Reach of a time: whatever it measures may last for ever."""
    return (0.0, UNLIMITED)


def at_most(limit: Callable[[DeployLimits], float]) -> Bounds:
    """Bounds of what has a greatest value alone."""
    return lambda limits: (-UNLIMITED, limit(limits))


def said_rule(name: str, action: Action, field: str) -> SafetyRule:
    """Return the rule about a field of `Glance` that is a reason, or None where all is well."""
    return SafetyRule(
        name=name,
        action=action,
        value=lambda glance: float(getattr(glance, field) is not None),
        bounds=lambda _: (-UNLIMITED, 0.0),
        reach=lambda _: (0.0, 1.0),
        reason=f"{{glance.{field}}}",
    )


SAFETY_RULES: tuple[SafetyRule, ...] = (
    said_rule("kill", "off", "kill"),
    said_rule("servo_stopped", "off", "stopped"),
    SafetyRule(
        name="position_window",
        action="off",
        value=lambda g: g.position,
        bounds=lambda limits: limits.bench.position,
        reach=lambda reach: reach.position,
        reason="the spool must stay within {low:.2f} to {high:.2f} rad from home; it is at "
        "{value:.2f} rad: is the tendon still fixed?",
    ),
    SafetyRule(
        name="duty",
        action="off",
        value=lambda g: g.disobeyed,
        bounds=at_most(lambda limits: limits.duty),
        reach=lambda _: (0.0, 2.0),
        reason="the servo must give the duty that it is sent; the present one differs by "
        "{value:.2f}, more than {high:g}: look at the servo",
    ),
    SafetyRule(
        name="motion",
        action="off",
        value=lambda g: g.strayed,
        bounds=lambda limits: (-limits.motion, limits.motion),
        reach=lambda reach: reach.position,
        reason="the spool must move as duty and tension make it, to {high:g} rad; it is "
        "{value:+.2f} rad from there: look at the servo, its encoder, its gear and the load cell",
    ),
    said_rule("encoder", "off", "stuck"),
    SafetyRule(name="voltage", action="off", value=lambda g: g.voltage,
        bounds=lambda limits: limits.voltage, reach=lambda reach: reach.voltage,
        reason="the supply must have {low:g} to {high:g} V; it has {value:.1f} V"),
    SafetyRule(
        name="servo_lost",
        action="off",
        value=lambda g: g.silence,
        bounds=at_most(lambda limits: limits.silence),
        reach=lasting,
        reason="the servo must answer; it has been silent for {value:.2f} s: see that its motor "
        "is off",
    ),
    said_rule("operator", "unwind", "stop"),
    SafetyRule(name="tension", action="unwind",
        value=lambda g: None if g.force is None else abs(g.force),
        bounds=at_most(lambda limits: limits.bench.force), reach=lambda reach: reach.force,
        reason="the tension must stay below {high:g} N; it is {value:.1f} N"),
    SafetyRule(name="pull", action="unwind", value=lambda g: g.pull,
        bounds=at_most(lambda limits: limits.bench.force), reach=lambda _: None,
        reason="the tension must stay below {high:g} N; by its duty the motor makes {value:.1f} N, "
        "and the load cell tells far less: look at the load cell, its calibration and the gear"),
    said_rule("load_cell", "unwind", "doubt"),
    SafetyRule(name="current", action="unwind", value=lambda g: g.current, delay=0.03,
        bounds=lambda limits: (-limits.current, limits.current), reach=lambda reach: reach.current,
        reason="the current must stay below {high:g} A; it is {value:.2f} A"),
    SafetyRule(name="temperature", action="unwind", value=lambda g: g.temperature,
        bounds=at_most(lambda limits: limits.bench.temperature),
        reach=lambda reach: reach.temperature,
        reason="the motor must stay below {high:g} degC; it has {value:.0f}: let it cool"),
    said_rule("log", "unwind", "failure"),
    said_rule("policy_failure", "unwind", "broken"),
    SafetyRule(name="missed_reads", action="hold", value=lambda g: g.silence,
        bounds=at_most(lambda limits: limits.stale_state), reach=lasting,
        reason="the position must not be older than {high:g} s; it is {value:.3f} s old"),
    SafetyRule(
        name="stale_force",
        action="hold",
        value=lambda g: g.blindness,
        patience=1.0,
        bounds=at_most(lambda limits: limits.stale_force),
        reach=lasting,
        reason="the tension must not be older than {high:g} s; it is {value:.2f} s old: look at "
        "the load cell's plug",
    ),
    SafetyRule(
        name="loop_overrun",
        action="hold",
        value=lambda g: float(g.skipped),
        patience=1.0,
        bounds=at_most(lambda limits: float(limits.skipped_ticks)),
        reach=lambda _: (0.0, SKIP_WINDOW - 1.0),
        reason="at most {high:.0f} ticks of eight may be skipped; {value:.0f} were: this computer "
        "is too busy",
    ),
    SafetyRule(name="policy_output", action="hold", value=lambda g: g.output, patience=0.5,
        bounds=lambda limits: (-limits.output, limits.output),
        reach=lambda _: (-UNLIMITED, UNLIMITED),
        reason="the policy must want an action within {high:g} rad; it wants {value:g}"),
    SafetyRule(
        name="command_rate",
        action="cut",
        value=lambda g: g.jump,
        bounds=lambda limits: (-limits.command_rate, limits.command_rate),
        reach=lambda _: None,  # a command that its range keeps slower needs no cut
        reason="a command may change by {high:g} rad/s; the policy wants {value:.0f}: it is cut",
    ),
)  # fmt: skip
"""What is looked at, from hard to mild. The text in `docs/deployment.md` is made from it."""
COMMON_RULES = ("kill", "operator", "log", "policy_failure", "loop_overrun")
"""Rules that are about no servo: of several servos the first one's guard applies them."""
COLLECTION_RULES = tuple(
    rule
    for rule in SAFETY_RULES
    if rule.name
    in ("position_window", "duty", "motion", "encoder", "tension", "pull", "temperature")
)
"""Rules that hold while data is collected; each switches the motor off."""


def stop_beyond(limits: SafetyLimits, glance: Glance) -> None:
    """Stop a recording that is beyond the limits of its rules.

    Raises:
        SafetyStop: It is; the message says which limit.
    """
    reason = broken_rule(limits, glance)
    if reason is not None:
        raise SafetyStop(f"{reason}; the motor is off")


def broken_rule(limits: SafetyLimits, glance: Glance) -> str | None:
    """Return what breaks a rule of a recording, in words, where something does."""
    every = DeployLimits(bench=limits)
    for rule in COLLECTION_RULES:
        value, (low, high) = rule.value(glance), rule.bounds(every)
        if value is not None and not low <= value <= high:
            return rule.reason.format(value=value, low=low, high=high, glance=glance)
    return None


def refuse_unreachable(
    limits: DeployLimits, reach: SensorReach, rules: Sequence[SafetyRule] = SAFETY_RULES
) -> None:
    """Refuse limits that their sensors can never pass.

    Raises:
        RuleOutOfReach: A rule could not act whatever happens; the message says how far it reaches.
    """
    for rule in rules:
        ends = rule.reach(reach)
        if ends is None:
            continue
        low, high = rule.bounds(limits)
        if high >= ends[1] or -UNLIMITED < low <= ends[0]:
            raise RuleOutOfReach(
                f"a safety rule must be able to act; {rule.name} acts beyond "
                f"{shown_range(low, high)}, and no more than {shown_range(*ends)} can be told: "
                "give a limit within"
            )


def shown_range(low: float, high: float) -> str:
    """Return a range in words."""
    return f"{high:.4g}" if low in (0.0, -UNLIMITED) else f"{low:.4g} to {high:.4g}"
