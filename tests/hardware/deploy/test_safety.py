"""The table of rules and its guard, without a bench."""

from dataclasses import replace
from pathlib import Path

import pytest

from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.rule_limits import DeployLimits, limits_for
from tendon_hardware.safety_rules.rules import HARDNESS, SAFETY_RULES, Glance
from tendon_hardware.safety_rules.rules_applied import SafetyGuard
from tendon_hardware.servos import SERVOS
from tendon_newton.errors import InvalidParameter

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
        ("position_window", "position", DeployLimits().position),
    ],
)
def test_a_limit_on_two_sides_is_kept_on_both(
    name: str, field: str, bounds: tuple[float, float]
) -> None:
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
