"""A fault for each safety rule, made on the virtual bench, and what must come of it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any

import numpy as np

from tendon_hardware.benches.bench import Bench
from tendon_hardware.control.goals import FixedGoal
from tendon_hardware.deployment.deploy_settings import DeploySettings
from tendon_hardware.errors import SafetyStop
from tendon_hardware.safety_rules.rule_limits import DeployLimits, limits_for
from tendon_hardware.servos import SERVOS
from tendon_hardware.stop_request import StopRequest
from tendon_hardware.virtual_bench.faults import ALERT_BITS
from tests.faults import injections as on
from tests.faults.injections import FULL, LONG, let
from tests.hardware.deploy.policies import policy_of
from tests.hardware.deploy.runs import Flight, closing

SETTINGS = DeploySettings(duration=6.0)
ALLOWED = 0.1  # From a fault to what is done against it [s]
NAN = float("nan")


def moments(number: int) -> list[float]:
    """Return when faults begin, since the first step [s], at all phases of a policy step."""
    return [0.4 + 0.0137 * k for k in range(number)]


class Spoilt:
    """A policy that goes bad when it is told to."""

    def __init__(self, act: Callable[[], Any], *, calm: bool = False) -> None:
        self.act = act
        self.calm = calm
        self.bad = False

    def __call__(self, sample: np.ndarray) -> Any:
        """Act well, or badly."""
        if self.bad:
            return self.act()
        return 0.0 if self.calm else closing(sample)

    def spoil(self, bench: Bench, stop: StopRequest) -> None:
        """Go bad."""
        self.bad = True


@dataclass(kw_only=True)
class Case:
    """A fault and the rule that must act against it."""

    rule: str  # Its name, or nothing where the run must go on as if nothing was
    sooner: tuple[str, ...] = ()  # Other rules that may act before it, each in its own way
    action: str
    fault: Callable[[Bench, StopRequest], None] | None = None
    settings: DeploySettings = SETTINGS
    # Makes what gives the outputs of a policy that goes bad
    bad: Callable[[], Callable[[], Any]] | None = None
    calm: bool = False  # Whether it does nothing before
    allowed: float = ALLOWED  # From the fault to the end of the action [s]
    # Whether its numbers are of the bench's own servo: another's loop pulls otherwise
    own: bool = False
    strong: bool = False  # Whether the bench's own servo is too slow for it to change anything
    settled: float = 0.0  # Time in which the finger comes to rest before the fault [s]
    # Whether the servo can be told to switch its motor off; else its watchdog takes the duty
    reachable: bool = True
    words: dict[str, Any] = field(default_factory=dict)

    def flight(self, after: float) -> Flight:
        """Prepare a deployment with this fault."""
        fault, words = self.fault, dict(self.words)
        if self.bad is not None:
            spoilt = Spoilt(self.bad(), calm=self.calm)
            fault = on.both(spoilt.spoil, *([] if self.fault is None else [self.fault]))
            words["policy"] = policy_of(spoilt)
        return Flight(settings=self.settings, fault=fault, after=after + self.settled, **words)

    def prepared(self, after: float, servo: str) -> Flight:
        """Prepare it with a servo, whose limits hold unless others are given."""
        flight = self.flight(after)
        flight.servo = servo
        limits = self.settings.limits
        if limits == DeployLimits(bench=limits.bench):
            spec = SERVOS[servo]
            limits = limits_for(spec, limits.bench, clip=2.0, load_cell_rate=None)
            flight.settings = replace(self.settings, limits=limits)
        return flight

    def examine(self, after: float, servo: str = "xc330_t288_t") -> float | None:
        """Fly and require what must come of it; return the time to the action [s]."""
        flight = self.prepared(after, servo)
        outcome = flight.fly()
        assert not flight.duty_after, "the motor does nothing at the end"
        assert not (flight.torque_after and self.reachable), "it is off"
        if not self.rule:
            assert outcome.fault is None, outcome.ended
            assert set(outcome.trips) <= {"operator"}, outcome.trips
            return None
        trips = [
            (trip, done)
            for trip, done in flight.acted
            if done >= flight.since
            and (
                (trip.rule.name, trip.action) == (self.rule, self.action)
                or trip.rule.name in self.sooner
            )
        ]
        assert trips, f"{self.rule} never acted; {outcome.trips}"
        trip, done = trips[0]
        latency = done - flight.since
        assert latency <= self.allowed, f"{latency:.3f} s"
        said = [*flight.operator.told, *flight.operator.announced]
        assert any(trip.reason in text for text in said)
        if self.rule == "operator":
            assert outcome.fault is None
        elif self.action in ("unwind", "off"):
            assert isinstance(outcome.fault, SafetyStop)
            assert str(outcome.fault) in [each.reason for each, _ in flight.acted]
        return latency


def limited(**changes: Any) -> DeploySettings:
    """Return settings with other limits."""
    return replace(SETTINGS, limits=DeployLimits(**changes))


def always(output: Any) -> Callable[[], Callable[[], Any]]:
    """Return what makes a policy that gives one output."""
    return lambda: lambda: output


def now_and_then() -> Callable[[], float]:
    """Return a policy that gives no number at every other step."""
    step = count()
    return lambda: NAN if next(step) % 2 else 0.5


def fail() -> Callable[[], Any]:
    """Return a policy that raises."""

    def act() -> Any:
        raise RuntimeError("the network broke")

    return act


def off(rule: str, fault: Callable[[Bench, StopRequest], None], **words: Any) -> Case:
    """Return a case that must switch the motor off."""
    return Case(rule=rule, action="off", fault=fault, **words)


def unwind(rule: str, fault: Callable[[Bench, StopRequest], None], **words: Any) -> Case:
    """Return a case that must let the tendon out."""
    return Case(rule=rule, action="unwind", fault=fault, **words)


def hold(rule: str, fault: Callable[[Bench, StopRequest], None], **words: Any) -> Case:
    """Return a case in which the last command must stay."""
    return Case(rule=rule, action="hold", fault=fault, **words)


def wanting(output: Any) -> Case:
    """Return a case of a policy that wants what it must not."""
    return Case(rule="policy_output", action="hold", bad=always(output))


def failing(bad: Callable[[], Callable[[], Any]]) -> Case:
    """Return a case of a policy that cannot decide."""
    return Case(rule="policy_failure", action="unwind", bad=bad)


SLOW_CELL: dict[str, Any] = {
    "settings": limited(stale_force=0.175),
    "words": {"load_cell_rate": 20},
    "allowed": 0.4,
}
"""A load cell whose readings take four times as long."""

CASES: dict[str, Case] = {
    "a spool out of its window": off("position_window", on.slip, own=True),
    "a sagging supply": off("voltage", on.sag),
    "a dip of the supply to 5 V": off("servo_stopped", let("supply_dip", voltage=5.0, duration=0.5),
        sooner=("voltage",)),
    "a supply too high": off("voltage", on.surge),
    **{f"an alert: {name}": off("servo_stopped", let("alert", alert=name)) for name in ALERT_BITS},
    "a restarted servo": hold("missed_reads", let("reboot")),
    "a dip of the supply to 2 V": hold("missed_reads",
        let("supply_dip", voltage=2.0, duration=0.1)),
    "too much tension": unwind("tension", on.load),
    "far too much tension": unwind("tension", on.overload),
    "a hot motor": unwind("temperature", on.heat),
    "a jammed gear": unwind("current", on.jam, bad=always(2.0), calm=True,
        settings=limited(current=0.02), own=True),
    "a saturated load cell": unwind("load_cell", on.stuck(FULL)),
    "a load cell saturated the other way": unwind("load_cell", on.stuck(-FULL - 1)),
    "a saturated load cell with 4 kg on it": unwind("load_cell", on.both(on.stuck(FULL), on.load)),
    "a frozen load cell, then 4 kg": unwind("load_cell", on.both(on.stuck(), on.load)),
    "a load cell stuck at 0 counts": unwind("load_cell", on.stuck(0)),
    "a load cell without noise": unwind("load_cell", on.hush, bad=always(0.0), calm=True,
        allowed=0.5),
    "a load cell that does not feel the motor":
        unwind("load_cell", let("cell_deaf", duration=LONG), allowed=2.5, own=True,
        words={"goals": FixedGoal(1.5, (0.0, 1.57))}),
    "a load cell that says 20 N too little": unwind("load_cell", on.lie(lambda f, t, k: f - 20.0)),
    "a load cell whose wires are exchanged":
        unwind("load_cell", on.lie(lambda f, t, k: -f), allowed=1.0),
    "a load cell that drifts by 5 N/s":
        unwind("load_cell", on.lie(lambda f, t, k: f - 5.0 * t), allowed=2.5),
    "a load cell that drifts by 1 N/s":
        unwind("load_cell", on.lie(lambda f, t, k: f - t), allowed=9.0,
        settings=DeploySettings(duration=12.0)),
    "a load cell that says 40 N too little":
        unwind("load_cell", on.lie(lambda f, t, k: f - 40.0), sooner=("tension",)),
    "a loose contact, every other reading is 0":
        unwind("load_cell", on.lie(lambda f, t, k: f * (k % 2)), allowed=1.0),
    "a loose contact with 4 kg": unwind("tension",
        on.both(on.lie(lambda f, t, k: f * (k % 2)), on.load)),
    "a loose contact with 4 kg, two of three readings are 0":
        unwind("tension", on.both(on.lie(lambda f, t, k: f * (k % 3 == 0)), on.load)),
    "a load cell that tells a quarter while the motor pulls":
        unwind("load_cell", on.lie(lambda f, t, k: 0.25 * f), own=True, bad=always(2.0), calm=True,
        allowed=2.5),
    "a load cell that tells a tenth while the motor pulls":
        unwind("load_cell", on.lie(lambda f, t, k: 0.1 * f), own=True, bad=always(2.0), calm=True,
        allowed=1.5),
    "a load cell that is dead at rest, once the motor pulls":
        unwind("load_cell", let("cell_deaf", duration=LONG), bad=always(2.0), calm=True,
        allowed=1.5, own=True),
    "two spikes of the load cell a tenth of a second apart":
        Case(rule="", action="", fault=on.lie(lambda f, t, k: f + 35.0 * (k in (0, 9)))),
    "one spike of the load cell": Case(rule="", action="", fault=let("cell_spike")),
    "one saturated reading": Case(rule="", action="", fault=let("cell_spike", counts=FULL)),
    "too much tension, the cell at 20 Hz": unwind("tension", on.load, **SLOW_CELL),
    "a saturated load cell at 20 Hz": unwind("load_cell", on.stuck(FULL), **SLOW_CELL),
    "a frozen load cell at 20 Hz": unwind("load_cell", on.stuck(), **SLOW_CELL),
    "a silent load cell": hold("stale_force", let("cell_silence", duration=0.4)),
    "a load cell that stays silent": unwind("stale_force", let("cell_silence", duration=LONG),
        allowed=1.2),
    "a load cell whose lines are all garbled": hold(  # a bit may but change a digit's case
        "stale_force", on.worse(garbled_lines=1.0), allowed=0.2
    ),
    "a shutdown": unwind("operator", on.terminate),
    "a lost terminal": unwind("operator", on.hang_up),
    "an interrupt": unwind("operator", on.interrupt),
    "a silent servo": hold("missed_reads", on.silence),
    "a servo that stays silent": off("servo_lost", on.silence, allowed=0.4),
    "an unplugged adapter": hold("missed_reads", let("unplug", duration=LONG), reachable=False),
    "answers that are all broken": hold("missed_reads", on.worse(corrupted_replies=1.0)),
    "answers that are 30 ms late": hold("missed_reads", on.worse(extra_latency=0.03)),
    "noise before every fifth answer": Case(rule="", action="", fault=on.worse(line_noise=0.2)),
    "a busy computer": hold("loop_overrun", on.stall, words={"in_step": True}),
    **{f"a policy that gives {output}": wanting(output) for output in (NAN, np.inf, -np.inf, 1e3,
        1e30, -1e30)},
    "a policy that gives NaN every other step":
        Case(rule="policy_output", action="unwind", bad=now_and_then, allowed=2.0),
    "a policy that raises": failing(fail),
    "a policy that gives None": failing(always(None)),
    "a policy that gives text": failing(always("close")),
    "a policy that gives no action": failing(always(())),
    "a policy that gives two actions": failing(always((0.1, 0.2))),
    "a policy that jumps": Case(rule="command_rate", action="cut", bad=always(2.0), calm=True,
        settings=limited(command_rate=10.0)),
}  # fmt: skip
"""Faults of a deployment in lockstep, by what breaks the rule."""
