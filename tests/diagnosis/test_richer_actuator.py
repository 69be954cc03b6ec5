"""A servo that is too simple gives way to one with a rotor, if that leaves less by its price."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.actuators import ACTUATORS, find_actuator
from tendon_newton.diagnosis.richer_actuator import richer_actuator
from tendon_newton.mechanisms.loading import load_mechanism
from tests.made import stated_model
from tests.physics.runs import GAIN, RADIUS, ideal_model, run_of

FINGER = [run_of(np.full(5, 1.0))]
DRIVE = {"kp": 20.0, "kd": 0.5, "max_torque": 20.0, "armature": 0.02}


def test_a_motor_rests_where_an_ideal_servo_does_and_gives_no_more() -> None:
    """Its force at rest is the gain's up to the limit of the finger's servo, and no more beyond."""
    found = richer_actuator(replace(ideal_model(), fit=("gain", "mass")), FINGER)
    assert found is not None
    assert (found.model.actuator.name, found.model.fit) == ("pwm_servo", ("mass", *found.numbers))
    limit = load_mechanism("finger").tendons[0].force_limit
    for error in (0.3, 2.0, 4.0 * limit / GAIN):
        force = find_actuator("pwm_servo").static_force(found.model.actuator.values, error, RADIUS)
        assert force == pytest.approx(min(GAIN * error, limit), rel=1e-12)


def test_numbers_that_nobody_stated_well_are_fitted() -> None:
    """A drive keeps its kind; a number that is fitted already, or that a log states, stays so."""
    model = stated_model("pd_torque", DRIVE, fit=("mass",))
    run = run_of(np.full(5, 1.0), bench="servo")
    found = richer_actuator(model, [run])
    assert found is not None
    assert (found.model.actuator, found.model.fit) == (model.actuator, ("mass", "kd", "armature"))
    stated = replace(run, actuator_overrides={"kd": 0.4})
    fitting = replace(model, fit=("armature",))
    assert richer_actuator(fitting, [stated]) is None


@pytest.mark.parametrize("kind", ["ideal_position", "measured_path", "learned"])
def test_a_servo_without_force_or_with_a_network_is_as_it_is(kind) -> None:
    """Nothing says more of these."""
    assert find_actuator(kind).doubtful == ()
    assert find_actuator(kind).richer({}, 1.0, 1.0) is None


def test_what_no_command_drives_has_no_servo_to_be_doubted() -> None:
    """Recordings of a force alone say nothing of what is before the cell."""
    run = replace(run_of(np.full(5, 1.0)), command=None, force=np.ones((5, 1)))
    assert richer_actuator(ideal_model(), [run]) is None


def test_doubtful_numbers_are_numbers_of_their_actuator() -> None:
    """Each is declared, and so has a range in which it is fitted."""
    for actuator in ACTUATORS.values():
        assert set(actuator.doubtful) <= {parameter.name for parameter in actuator.parameters}
