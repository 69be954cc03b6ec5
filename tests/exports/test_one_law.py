"""Every engine that carries the law of servo, gear and spool, against a formula of its own."""

import numpy as np
import pytest

from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import replayed
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tests.exports.models import PWM, model_of, short_run
from tests.physics.runs import run_of

BENCH = "spring_weak"
IN_PLAY = ("backlash", "hysteresis", "command_rate_limit", "acceleration_limit", "overload_cut")
IN_PLAY += ("viscoelastic_spring", "actuator_lag", "torque_fade", "holding_friction")


@pytest.mark.parametrize("engine", ["rollout", "mujoco: tendon_step.py", "newton: tendon_drive.py"])
def test_a_string_that_stretches_carries_at_rest_what_its_motor_gives(engine, tmp_path) -> None:
    """F = k_t u V / (R r), with u of the angle reported: spool and string balance each other."""
    model = model_of(BENCH, "pwm_servo", "tendon_compliance")
    run = run_of(np.concatenate([np.full((4, 1), 0.5), np.full((76, 1), 1.5)]), bench=BENCH)
    target, _, way = engine.partition(": ")
    if way:
        exported = EXPORTS[target].write(tmp_path, bench_of(BENCH, model), model)
        (found,) = replayed(EXPORTS[target], exported, way, model, [run])
    else:
        (found,) = replay([run], model)
    duty = PWM["duty_per_rad"] * (1.5 - found.motor_position[-1, 0])
    current = duty * PWM["supply_voltage"] / PWM["resistance"]
    force = PWM["torque_constant"] * current / PWM["spool_radius"]
    assert force > 1.0
    assert found.force[-1, 0] == pytest.approx(force, rel=0.01)  # a second after the step


@pytest.mark.slow
def test_a_loose_spool_inside_the_play_of_its_gear_is_moved_by_its_motor_alone() -> None:
    """Nothing is in touch there, so that a string's tension takes no share of the motor's force."""
    model = model_of("finger", "pwm_servo", *IN_PLAY)
    (found,) = replay([short_run("finger", model, rows=40)], model)
    assert np.isfinite(found.motor_velocity).all()
    assert np.abs(found.motor_position).max() < 1.0  # rad: inside the range of the commands
