"""Where all forces or travels grow, and all that they move, nothing moves or reads otherwise."""

from typing import Any

import numpy as np
import pytest

from tendon_newton.data.parameters import Parameter
from tendon_newton.effects import EFFECTS, find_effect
from tests.effect_bench import commanded, simulate, steps_and_waves

GROWN = 1.25
MASS = 0.05  # Mass of the weak spring's bench [kg]: an inertia is in proportion to it
SCALES = ("gain_error", "joint_stiffness_error", "joint_damping_error", "load_cell_gain")
READ = ("current_sensor_gain", "voltage_sensor_sag")  # Sensors beside the force
FORCES = [
    effect for effect in EFFECTS
    if effect not in (*SCALES, *READ, "inertia_error")
    and any("N" in p.unit + p.of for p in find_effect(effect).parameters)
]  # fmt: skip

TRAVELS = [
    effect for effect in EFFECTS
    if effect not in (*SCALES, *READ, "inertia_error", "spool_radius_error")
    and any(p.force_power or p.travel_power for p in find_effect(effect).parameters)
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


@pytest.mark.parametrize("effect", TRAVELS)
@pytest.mark.parametrize("forces", [0, 1])
def test_travels_of_an_effect_grow_on_a_larger_spool(effect: str, forces: int) -> None:
    """Springs, dampers and a mass are a fifth less, or the servo a quarter more."""
    numbers = {p.name: p for p in find_effect(effect).parameters}
    power = {name: forces * p.force_power + p.travel_power for name, p in numbers.items()}
    scales = {
        name: {"scale": GROWN ** (forces * scale.force_power + scale.travel_power)}
        for name in (*SCALES, "spool_radius_error")
        for scale in find_effect(name).parameters[:1]
    }
    plain = {name: acting(p) for name, p in numbers.items()}
    grown = {name: value * GROWN ** power[name] for name, value in plain.items()}
    command = 0.5 * steps_and_waves()
    one = simulate(commanded(command), {effect: plain})
    mass = MASS * GROWN ** (forces - 1)
    alike = simulate(commanded(command, mass=mass), {effect: grown, **scales})
    assert np.abs(one.motor_position - alike.motor_position).max() < 1.0e-7
    assert np.abs(one.force - alike.force).max() < 1.0e-6


@pytest.mark.parametrize("effect", READ)
def test_a_sensor_reads_alike_where_forces_grow(effect: str) -> None:
    """A motor's current, and what its supply gives way by, are in proportion to its force."""
    law: Any = find_effect(effect)
    force, time = np.array([[1.0, 0.0], [3.0, 0.0]]), np.zeros(2)
    (number,) = law.parameters
    read = law.current_reading if effect.startswith("current") else law.voltage_reading
    less, more = (np.array([acting(number) * grown**number.force_power]) for grown in (1.0, GROWN))
    at_rest = read(0.0 * force, time, less)
    own, other = read(force, time, less), read(GROWN * force, time, more)
    column = 0 if effect.startswith("current") else 1
    assert other[:, column] == pytest.approx(own[:, column])
    assert np.ptp(own[:, column] - at_rest[:, column]) > 0.0
