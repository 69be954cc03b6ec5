"""Each safety rule broken on the virtual bench: the right action, in time, and a motor that is off.

In lockstep the bench's clock is the judge, so that a busy machine changes no figure.
"""

import os
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_hardware.deployment.deploy_replay import replay_log
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.rule_limits import DeployLimits, limits_for
from tendon_hardware.safety_rules.rules import HARDNESS, SAFETY_RULES, Glance
from tendon_hardware.safety_rules.rules_applied import SafetyGuard
from tendon_hardware.servos import SERVOS
from tendon_hardware.virtual_bench import Faults
from tendon_newton.errors import InvalidParameter
from tests.faults.cases import CASES, SETTINGS, moments
from tests.faults.lies import CHEAP
from tests.hardware.deploy.runs import Flight
from tests.hardware.silent_operator import SilentOperator

ELSEWHERE = {"kill", "log"}  # Rules that have tests of their own below


@pytest.mark.parametrize("count", [1, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", CASES | CHEAP)
def test_a_fault_is_acted_upon_in_time(name: str, count: int) -> None:
    """The table's action follows the fault in time, its reason is told, the motor ends off."""
    for after in moments(count):
        (CASES | CHEAP)[name].examine(after)


def test_every_rule_of_the_table_is_broken_here() -> None:
    """A new rule needs a fault that breaks it."""
    broken = {case.rule for case in (CASES | CHEAP).values() if case.rule}
    assert broken | ELSEWHERE == {rule.name for rule in SAFETY_RULES}


def test_a_hold_keeps_the_command_and_ends_with_its_cause(tmp_path: Path) -> None:
    """While the load cell is silent the command stays; when it is back the policy goes on."""
    flight = CASES["a silent load cell"].flight(0.5)
    flight.path = tmp_path / "run.mcap"
    outcome = flight.fly()
    assert outcome.fault is None
    assert outcome.trips == {"stale_force": 1, "operator": 1}
    held = [shown.command for shown in flight.operator.shown if shown.mode == "hold"]  # pyright: ignore
    assert held
    assert len(set(held)) == 1
    assert replay_log(flight.policy, flight.path).broken == 0


def test_a_servo_that_comes_back_in_time_is_driven_on() -> None:
    """A tenth of a second of lost answers is held through."""
    flight = Flight(settings=SETTINGS, after=0.5)

    def lose(bench, stop) -> None:
        bench.controls.set_faults(Faults(dropped_replies=1.0))

    def find(bench) -> None:
        bench.controls.set_faults(Faults())

    def happen(bench, stop) -> None:
        lose(bench, stop)
        happened.append(bench)

    happened: list = []
    flight.fault = happen
    flight.operator.show = lambda progress: (
        find(happened[0]) if happened and progress.mode == "hold" else None  # pyright: ignore
    )
    outcome = flight.fly()
    assert outcome.fault is None
    # waiting for answers takes ticks, more of them where a step is due as well
    assert set(outcome.trips) - {"loop_overrun"} == {"missed_reads", "operator"}


def test_a_terminal_that_is_gone_does_not_stop_the_loop() -> None:
    """What cannot be printed any more is not; the tendon is let out all the same."""
    gone: list[bool] = []

    class Terminal(SilentOperator):
        def tell(self, text: str) -> None:
            super().tell(text)
            if gone:
                raise OSError(5, "Input/output error")

        def show(self, progress) -> None:
            self.tell("figures")

    def hang_up(bench, stop) -> None:
        gone.append(True)
        os.kill(os.getpid(), signal.SIGHUP)

    flight = Flight(settings=SETTINGS, after=1.5, fault=hang_up, operator=Terminal())
    outcome = flight.fly()
    assert outcome.ended == "stopped by SIGHUP"
    assert flight.angle_after < 0.1
    assert not flight.torque_after


WELL = Glance(
    now=0.0,
    position=1.0,
    force=3.0,
    blindness=0.01,
    current=0.05,
    voltage=11.1,
    temperature=30.0,
    output=0.5,
)


def test_nothing_happens_while_all_is_well() -> None:
    """No rule comes into effect within its bounds, nor where nothing is known."""
    guard = SafetyGuard(DeployLimits())
    assert guard.judge(WELL) == []
    assert guard.judge(Glance(now=0.1)) == []
    assert guard.mode == "run"


@pytest.mark.parametrize(
    "field", ["position", "force", "current", "voltage", "temperature", "output"]
)
def test_what_is_no_number_breaks_its_rule(field: str) -> None:
    """Not-a-number lies within no bounds."""
    guard = SafetyGuard(DeployLimits())
    bad = replace(WELL, **{field: float("nan")})
    trips = guard.judge(bad) + guard.judge(replace(bad, now=0.1))
    assert len(trips) == 1


def test_the_hardest_action_wins_and_stays() -> None:
    """Unwinding does not end when its cause does, and off is for good."""
    guard = SafetyGuard(DeployLimits())
    guard.judge(replace(WELL, force=31.0, output=1e3))
    assert guard.mode == "unwind"
    guard.judge(replace(WELL, now=0.1))
    assert guard.mode == "unwind"
    guard.judge(replace(WELL, now=0.2, stopped="overload"))
    assert guard.mode == "off"
    guard.judge(replace(WELL, now=0.3))
    assert guard.mode == "off"


def test_a_hold_ends_with_its_cause_or_with_its_patience() -> None:
    """Half a second of a policy's nonsense is held through, more is not."""
    guard = SafetyGuard(DeployLimits())
    assert [t.action for t in guard.judge(replace(WELL, output=1e3))] == ["hold"]
    assert guard.judge(replace(WELL, now=0.4, output=1e3)) == []
    assert guard.judge(replace(WELL, now=0.45)) == []
    assert guard.mode == "run"
    assert [t.action for t in guard.judge(replace(WELL, now=0.5, output=1e3))] == ["hold"]
    (trip,) = guard.judge(replace(WELL, now=1.1, output=1e3))
    assert (trip.action, trip.rule.name, trip.since) == ("unwind", "policy_output", 0.5)
    assert guard.judge(replace(WELL, now=1.2, output=1e3)) == []
    assert guard.mode == "unwind"


def test_a_limit_that_is_passed_for_a_moment_only_is_forgiven_where_a_rule_says_so() -> None:
    """One reading of a current spike does nothing; three in a row do."""
    guard = SafetyGuard(DeployLimits())
    assert guard.judge(replace(WELL, current=0.7)) == []
    assert guard.judge(replace(WELL, now=0.0125)) == []
    for tick in range(2, 5):
        trips = guard.judge(replace(WELL, now=0.0125 * tick, current=0.7))
    assert guard.mode == "run"
    trips = guard.judge(replace(WELL, now=0.0125 * 5, current=0.7))
    assert [trip.rule.name for trip in trips] == ["current"]


@pytest.mark.parametrize(
    ("name", "field", "bounds"),
    [
        ("current", "current", (-DeployLimits().current, DeployLimits().current)),
        ("voltage", "voltage", DeployLimits().voltage),
        ("position_window", "position", DeployLimits().bench.position),
        # a load cell may hang upside down
        ("tension", "force", (-DeployLimits().bench.force, DeployLimits().bench.force)),
    ],
)
def test_a_limit_on_two_sides_is_kept_on_both(name, field, bounds) -> None:
    """A current that brakes may be as great as one that drives, and no greater."""
    low, high = bounds
    for value, tripped in ((low - 0.1, [name]), (low, []), (high, []), (high + 0.1, [name])):
        guard, sight = SafetyGuard(DeployLimits()), replace(WELL, **{field: value})
        trips = [t for tick in range(4) for t in guard.judge(replace(sight, now=0.02 * tick))]
        assert [trip.rule.name for trip in trips] == tripped


def test_rules_have_names_reasons_and_actions_of_the_table() -> None:
    """Names are unique, every reason can be told, and the docs list every rule."""
    names = [rule.name for rule in SAFETY_RULES]
    assert len(set(names)) == len(names)
    page = Path(__file__).resolve().parents[3] / "docs" / "deployment.md"
    listed = page.read_text(encoding="utf-8")
    for rule in SAFETY_RULES:
        assert rule.action in HARDNESS
        assert f"`{rule.name}`" in listed
        low, high = rule.bounds(DeployLimits())
        assert low <= high
        text = rule.reason.format(value=1.0, low=low, high=high, glance=replace(WELL, kill="x"))
        assert text


def test_limits_follow_from_servo_policy_and_load_cell() -> None:
    """Voltage and current come from the data sheet, staleness from the load cell's rate."""
    spec = SERVOS["xl330_m288_t"]
    limits = limits_for(spec, SafetyLimits(), clip=2.0, load_cell_rate=20.0)
    assert limits.voltage == pytest.approx((3.7, 6.3))
    assert limits.current == pytest.approx(0.65 * 1.47)
    assert limits.output == 20.0
    assert limits.stale_force == pytest.approx(0.175)
    quick = limits_for(spec, SafetyLimits(), clip=2.0, load_cell_rate=80.0)
    assert quick.stale_force == DeployLimits().stale_force


@pytest.mark.parametrize(
    "changes",
    [
        {"voltage": (12.0, 6.0)},
        {"current": 0.0},
        {"output": float("inf")},
        {"skipped_ticks": -1},
        {"command_rate": float("nan")},
    ],
)
def test_limits_that_limit_nothing_are_refused(changes: dict) -> None:
    """Before any motor runs."""
    with pytest.raises(InvalidParameter):
        DeployLimits(**changes)
