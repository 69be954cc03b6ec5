"""What a plant file says of the gear, against the gear itself."""

from dataclasses import replace

import pytest

from tendon_hardware.virtual_bench.emulation.truth import actuator_effects
from tendon_hardware.virtual_bench.physics.constants import ServoConstants
from tendon_hardware.virtual_bench.physics.motor import Motor
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.data.gear_friction import quasi_static_gear

SPEED = 0.8  # [rad/s] so fast that nothing is left of what holds at rest


def forces(servo: ServoConstants, duty: float, direction: float) -> tuple[float, float]:
    """Return the motor's force and the tension that balances it at a constant speed [N]."""
    low, high = 0.0, 100.0
    motor = Motor(servo)
    for _ in range(60):
        tension = 0.5 * (low + high)
        motor.enabled, motor.rate, motor.duty = True, direction * SPEED, duty
        motor.voltage = motor.supply
        motor.temperature = 25.0
        before = motor.rate
        motor.advance(tension, 1e-6)
        if motor.rate > before:
            low = tension
        else:
            high = tension
    return motor.current * servo.torque_constant / servo.spool_radius, 0.5 * (low + high)


def true_effects() -> dict[str, dict[str, float]]:
    """Return what the plant file of unit 0 says of the servo."""
    return dict(actuator_effects(draw_unit("finger", 0)))


def test_the_load_friction_of_a_plant_file_is_what_a_model_of_one_load_would_find() -> None:
    """Unit 0: 0.50 on a motor of 0.86 its force; its tendon's part alone would be 0.24."""
    truth = true_effects()
    assert truth["load_dependent_friction"]["coefficient"] == pytest.approx(0.50, abs=5e-3)
    assert truth["gain_error"]["scale"] == pytest.approx(0.86, abs=5e-3)
    assert draw_unit("finger", 0).servo.tendon_load_friction == pytest.approx(0.24, abs=5e-3)


@pytest.mark.parametrize("duty", [0.2, 0.5])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_gear_gives_what_its_plant_file_says(duty: float, direction: float) -> None:
    """Driving and driven, the balance is g F_m / (1 + s mu) (1e-3: one step's inertia)."""
    truth = true_effects()
    bare = replace(draw_unit("finger", 0).servo, dry_friction=0.0, viscous_friction=0.0)
    motor, tension = forces(bare, duty, direction)
    gain, load = truth["gain_error"]["scale"], truth["load_dependent_friction"]["coefficient"]
    assert tension == pytest.approx(gain * motor / (1.0 + direction * load), rel=1e-3)


def test_dry_friction_before_the_load_is_that_of_both_directions_mean() -> None:
    """C' is C (1 + s c_m) / (1 + c_m c_e) on the side s; the file has the mean."""
    servo = draw_unit("finger", 0).servo
    bare = replace(servo, viscous_friction=0.0)
    mu, gain = quasi_static_gear(servo.motor_load_friction, servo.tendon_load_friction)
    found = []
    for direction in (1.0, -1.0):
        motor, tension = forces(bare, 0.5, direction)
        found.append(direction * (gain * motor - (1.0 + direction * mu) * tension))
    dry = true_effects()["stribeck_friction"]["coulomb_force"]
    assert found[0] / found[1] == pytest.approx(
        (1.0 + servo.motor_load_friction) / (1.0 - servo.motor_load_friction), rel=1e-2
    )
    assert sum(found) / 2.0 == pytest.approx(dry, rel=1e-2)  # of forces of 10 N


def test_viscous_friction_is_what_a_model_with_the_motors_own_constants_lacks() -> None:
    """The back-EMF belongs to the motor; of the gear's grease it is both directions' mean."""
    servo, truth = replace(draw_unit("finger", 0).servo, dry_friction=0.0), true_effects()
    mu, gain = quasi_static_gear(servo.motor_load_friction, servo.tendon_load_friction)
    found = []
    for direction in (1.0, -1.0):
        motor, tension = forces(servo, 0.5, direction)
        found.append(direction * (gain * motor - (1.0 + direction * mu) * tension))
    drag = truth["viscous_friction"]["coefficient"] * SPEED
    assert sum(found) / 2.0 == pytest.approx(drag, rel=2e-2)  # of forces of 10 N
