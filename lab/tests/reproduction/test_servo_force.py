"""What a servo's model lacks of a tension, against tensions of a known servo."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tendon_lab.reproduction.servo_force import MeasuredServo, missing_force
from tendon_lab.reproduction.unit_correction import CorrectedSource, lasting_force
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.simulation.hosts.replay import simulated_recording
from tendon_newton.simulation.simulators import TendonSimulator
from tendon_train.actuator.samples.servo_law import ServoLaw
from tests.physics.learned.networks import force_network

LAW = ServoLaw(stiffness=5.0, damping=2.0, dry_friction=0.0, load_friction=0.3)
SERVO = MeasuredServo.of(LAW)


@pytest.fixture
def motion() -> Recording:
    """A slow sinusoid of the shaft behind a command that leads it, with rests."""
    time = np.arange(400) / 80.0
    angle = 1.0 + 0.5 * np.clip(1.3 * np.sin(2.0 * time), -1.0, 1.0)
    return Recording(
        name="motion",
        bench="finger",
        time=time,
        motor_position=angle[:, None],
        motor_velocity=np.gradient(angle, time)[:, None],
        command=angle[:, None] + 1.2,
        force=np.zeros((400, 1)),
    )


def motor_force(motion: Recording, added: float | Array = 0.0) -> Array:
    """Return P (theta_d - theta) - D theta_dot of `LAW`, and something added [N]."""
    lead = motion.command[:, 0] - motion.motor_position[:, 0]
    return LAW.stiffness * lead - LAW.damping * motion.motor_velocity[:, 0] + added


def test_what_was_added_is_what_is_missing(motion: Recording) -> None:
    """F = F_m - (c + mu F) sign(theta_dot), solved for F while the shaft turns; F_m has more."""
    rng = np.random.default_rng(0)
    added = rng.uniform(-2.0, 2.0, 400)
    side = np.sign(motion.motor_velocity[:, 0])
    motor = motor_force(motion, added)
    tension = (motor - side * LAW.dry_friction) / (1.0 + side * LAW.load_friction)
    turning = np.abs(motion.motor_velocity[:, 0]) > 0.1
    found = missing_force(replace(motion, force=tension[:, None]), SERVO)
    # of the motor itself: what is missing is on its side of the gear, whose loss the servo has
    np.testing.assert_allclose(found[turning], added[turning] / (1.0 + LAW.load_friction))


def test_the_law_is_that_of_the_simulator() -> None:
    """Nothing is missing of a tension that the simulator makes of the same servo.

    0.02 N: the row of a force is that of the angles, but friction's side changes within a step.
    """
    servo = replace(SERVO, damping=0.0)
    values = {"gain": servo.stiffness, "spool_radius": 0.0125}
    model = Model(actuator=NamedValues(name="ideal", values=values), effects=servo.frictions)
    time = np.arange(640) / 80.0
    ask = 2.0 + 1.2 * np.sin(2.0 * time)[:, None]
    told = Recording(
        name="told",
        bench="spring_weak",
        time=time,
        motor_position=np.zeros((640, 1)),
        motor_velocity=np.zeros((640, 1)),
        command=ask,
    )
    (trajectory,) = TendonSimulator().simulate([told], model)
    made = simulated_recording(told, trajectory)
    speed = np.abs(made.motor_velocity[:, 0])
    sliding = (speed > 0.15) & (time > 1.0)
    assert sliding.sum() > 200
    assert float(np.ptp(made.force[sliding])) > 2.0
    np.testing.assert_allclose(missing_force(made, servo)[sliding], 0.0, atol=0.02)


def test_a_standing_shaft_may_hold_any_force_between(motion: Recording) -> None:
    """Nothing is missing where friction explains the tension."""
    standing = motion.motor_velocity[:, 0] == 0.0
    motor = motor_force(motion)
    recording = replace(motion, force=motor[:, None])  # between motor / 1.3 and motor / 0.7
    assert standing.sum() > 50
    np.testing.assert_array_equal(missing_force(recording, SERVO)[standing], 0.0)


def test_a_network_learns_what_is_missing_when_it_is_asked_again(motion: Recording) -> None:
    """Of commands at 20 Hz in a log at 80 Hz, the fourth row tells; the late first ones do not."""
    staircase = np.repeat(motion.command[::4], 4, axis=0)
    recording = replace(motion, command=staircase, force=np.full((400, 1), 3.0))
    missing = missing_force(recording, SERVO)
    expected = missing[np.arange(400) // 4 * 4 + 3]
    np.testing.assert_array_equal(lasting_force(recording, SERVO, 20.0)[::4], expected[::4])
    every_row = replace(recording, command=motion.command + 1e-3 * np.arange(400)[:, None])
    np.testing.assert_array_equal(
        lasting_force(every_row, SERVO, 20.0), missing_force(every_row, SERVO)
    )


def test_friction_both_ways_is_friction_that_holds() -> None:
    """F = P e - D v - (c + mu F) s solved for F, on either side."""
    law = replace(LAW, dry_friction=1.2)
    servo = MeasuredServo.of(law)
    motor = 7.0
    pulling = motor / 1.3 - servo.dry_friction
    yielding = (motor / 1.3 + servo.dry_friction) / (1.0 - servo.held_share)
    assert pulling == pytest.approx((motor - 1.2) / 1.3)
    assert yielding == pytest.approx((motor + 1.2) / 0.7)


def test_a_load_cell_below_its_zero_misses_nothing() -> None:
    """Noise about zero on a slack tendon is no lack of force, whichever sign it has."""
    time = np.arange(40) / 80.0
    still = Recording(
        name="slack",
        bench="finger",
        time=time,
        motor_position=np.ones((40, 1)),
        motor_velocity=np.zeros((40, 1)),
        command=np.zeros((40, 1)),
        force=np.tile([[0.01], [-0.01]], (20, 1)),
    )
    np.testing.assert_array_equal(missing_force(still, SERVO), 0.0)


def test_a_corrected_source_adds_its_share() -> None:
    """P (theta_d - theta) - D theta_dot of the last sample, and half of what the network says."""
    network = force_network()
    window = torch.rand(3, network.window, 3)
    both = CorrectedSource(network, SERVO, share=0.5, bound=100.0)(window)
    last = window[:, -1]
    alone = SERVO.stiffness * (last[:, 0] - last[:, 1]) - SERVO.damping * last[:, 2]
    torch.testing.assert_close(both, alone + 0.5 * network(window))


def test_a_network_adds_no_more_than_was_missing_in_training() -> None:
    """Far from all that was recorded the servo's own force decides, to within the bound."""
    network = force_network()
    window = 100.0 * torch.rand(64, network.window, 3)
    source = CorrectedSource(network, SERVO, share=1.0, bound=0.01)
    added = (source(window) - source.source(window)).detach().abs()
    assert float(added.max()) <= 0.01 + 1e-4  # float32
