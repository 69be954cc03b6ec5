"""Slopes that only steer the integrator: each is that of its law, by a central difference."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.law import gear, joint, servo

NUDGE = 1e-4


def jet(value: float, by_place: float = 0.0, by_speed: float = 0.0) -> Any:
    """A value with its slopes, as device code has it; a number of Python is a `real`."""
    return np.array([value, by_place, by_speed])


@pytest.fixture(autouse=True)
def plain_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws in plain Python, without effects."""
    for module in (gear, joint, servo):
        monkeypatch.setattr(module, "real", float)
        monkeypatch.setattr(module, "Jet", jet)
    for name in ("spring_effects", "damping_effects"):
        monkeypatch.setattr(joint, name, lambda torque, _joint, _p: torque)
    monkeypatch.setattr(gear, "rubbed_guides", lambda force, _tendon, _p: force)
    monkeypatch.setattr(gear, "is_outrun", lambda _tendon: False)


def has_its_slopes(law: Callable[[float, float], Any], place: float, speed: float) -> bool:
    """Tell whether a law's slopes by place and speed are those of its values."""
    _, *slopes = law(place, speed)
    steps = ((NUDGE, 0.0), (0.0, NUDGE))
    found = [(law(place + dx, speed + dv)[0] - law(place - dx, speed - dv)[0]) / (2.0 * NUDGE)
             for dx, dv in steps]  # fmt: skip
    return slopes == pytest.approx(found, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("place", [-2.0, 0.3, 2.0])
def test_a_limit_is_flat_beyond_and_lets_all_through_within(place: float) -> None:
    """A force of -3 x - v between -2 and 2."""
    clip: Any = servo.clip
    assert has_its_slopes(lambda x, v: clip(jet(-3.0 * x - v, -3.0, -1.0), -2.0, 2.0), place, 0.1)


@pytest.mark.parametrize("law", [joint.spring_torque, joint.damping_torque])
def test_springs_and_dampers_have_their_slopes(law: Any) -> None:
    """Of 2 N m/rad about a rest, and of 0.4 N m s/rad."""

    def at(place: float, speed: float) -> Any:
        own = SimpleNamespace(position=place, velocity=speed, stiffness=2.0, rest=0.1, damping=0.4)
        return law(own, None)

    assert has_its_slopes(at, 0.5, -0.7)


@pytest.mark.parametrize("carried", [0.0, 1.3])
def test_what_a_gear_leaves_has_its_slopes(carried: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a motor's 3 - 2 x - 0.7 v a gear leaves 0.8, less 0.3 N, 0.5 v and bristles of 6 x."""

    def at(place: float, speed: float) -> Any:
        left = lambda force, _tendon, _p: (  # noqa: E731
            0.8 * force + jet(-0.3 - 0.5 * speed - 6.0 * place, -6.0, -0.5)
        )
        monkeypatch.setattr(gear, "HAS_BRISTLES", True)
        monkeypatch.setattr(gear, "after_gear", left)
        motor = jet(3.0 - 2.0 * place - 0.7 * speed, -2.0, -0.7)
        flow: Any = SimpleNamespace(motor_force=motor)
        tendon: Any = SimpleNamespace(carried=carried)
        rotor_flow: Any = gear.rotor_flow
        return rotor_flow(flow, tendon, None).tension

    assert has_its_slopes(at, 0.5, -0.7)
