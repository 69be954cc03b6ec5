"""The rule of the tension looks at its size: a load cell may hang upside down."""

import pytest

from tendon_hardware.safety_rules.rule_limits import DeployLimits
from tendon_hardware.safety_rules.rules import SAFETY_RULES, Glance


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_tension_of_either_sign_is_kept_below_its_limit(side: float) -> None:
    """What is a newton beyond the limit is beyond it on both sides, and nothing is at the limit."""
    (rule,) = (rule for rule in SAFETY_RULES if rule.name == "tension")
    limits = DeployLimits()
    low, high = rule.bounds(limits)
    for force, safe in ((limits.bench.force, True), (limits.bench.force + 1.0, False)):
        value = rule.value(Glance(now=0.0, force=side * force))
        assert value is not None
        assert (low <= value <= high) == safe
