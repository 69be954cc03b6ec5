"""Where all forces grow, and all that they move, nothing moves or reads otherwise."""

import numpy as np
import pytest

from tendon_newton.data.parameters import Parameter
from tendon_newton.effects import EFFECTS, find_effect
from tests.effect_bench import commanded, simulate, steps_and_waves

GROWN = 1.25
MASS = 0.05  # Mass of the weak spring's bench [kg]: an inertia is in proportion to it
SCALES = ("gain_error", "joint_stiffness_error", "joint_damping_error", "load_cell_gain")
FORCES = [
    effect for effect in EFFECTS
    if effect not in (*SCALES, "inertia_error")
    and any("N" in p.unit + p.of for p in find_effect(effect).parameters)
]  # fmt: skip


def acting(number: Parameter) -> float:
    """Return a value at which an effect acts."""
    value = number.nominal if number.nominal != number.null else 0.4 * number.upper
    return {"limit": 0.7, "duty": 0.2, "time": 0.05}.get(number.name, 1.0) * value


@pytest.mark.parametrize("effect", FORCES)
def test_forces_of_an_effect_grow_with_all_others(effect: str) -> None:
    """A servo, springs, dampers and a mass are a quarter more; the cell reads a fifth less."""
    scales = {name: {"scale": GROWN ** find_effect(name).parameters[0].force_power}
              for name in SCALES}  # fmt: skip
    numbers = find_effect(effect).parameters
    plain = {p.name: acting(p) for p in numbers}
    grown = {p.name: plain[p.name] * GROWN**p.force_power for p in numbers}
    command = 0.5 * steps_and_waves()  # beyond, the servo's own limit does not grow
    one = simulate(commanded(command), {effect: plain})
    alike = simulate(commanded(command, mass=GROWN * MASS), {effect: grown, **scales})
    assert np.abs(one.motor_position - alike.motor_position).max() < 1.0e-7
    assert np.abs(one.force - alike.force).max() < 1.0e-6
