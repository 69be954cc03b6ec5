"""What a servo's model lacks of a tension, against tensions of a known servo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from tendon_newton.data.recording import Array, Recording
from tests.physics.learned.networks import force_network
from train.actuator.samples.servo_law import ServoLaw
from train.reproduction.correction import CorrectedSource, lasting_force
from train.reproduction.servo_force import Servo, ServoForce, missing_force

LAW = ServoLaw(stiffness=5.0, damping=2.0, dry_friction=0.0, load_friction=0.3)
SERVO = Servo.of(LAW)


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


def tension(motion: Recording, added: Array) -> Array:
    """Return the tension of the known servo with a force added to its motor's."""
    speed = motion.motor_velocity[:, 0]
    pulling, yielding = ServoForce(motion, SERVO)(added)
    return np.where(speed < 0.0, yielding, pulling)


def test_friction_takes_while_winding_in_and_gives_while_winding_out(motion: Recording) -> None:
    """P e - c theta_dot, divided by 1 + mu or 1 - mu: F = F_m - mu F sign(v)."""
    motor = 5.0 * 1.2 - 2.0 * motion.motor_velocity[:, 0]
    pulling, yielding = ServoForce(motion, SERVO)(np.zeros(400))
    # the mechanism keeps its spool's radius in float32
    np.testing.assert_allclose(pulling, motor / 1.3, rtol=1e-6)
    np.testing.assert_allclose(yielding, motor / 0.7, rtol=1e-6)


def test_what_was_added_is_what_is_missing(motion: Recording) -> None:
    """While the shaft turns the force is found to 5 mN, through frictions in proportion to load."""
    rng = np.random.default_rng(0)
    added = rng.uniform(-2.0, 2.0, 400)
    recording = replace(motion, force=tension(motion, added)[:, None])
    turning = np.abs(motion.motor_velocity[:, 0]) > 0.1
    found = missing_force(recording, SERVO)
    np.testing.assert_allclose(found[turning], added[turning], atol=6e-3)  # 84 N / 2^14


def test_a_standing_shaft_may_hold_any_force_between(motion: Recording) -> None:
    """Nothing is missing where friction explains the tension."""
    standing = motion.motor_velocity[:, 0] == 0.0
    pulling, yielding = ServoForce(motion, SERVO)(np.zeros(400))
    recording = replace(motion, force=(0.5 * (pulling + yielding))[:, None])
    assert standing.sum() > 50
    np.testing.assert_allclose(missing_force(recording, SERVO)[standing], 0.0, atol=6e-3)


def test_a_slack_tendon_misses_nothing() -> None:
    """Far below the spool's angle the command asks for no tension, and none is there."""
    time = np.arange(40) / 80.0
    still = Recording(
        name="slack",
        bench="finger",
        time=time,
        motor_position=np.ones((40, 1)),
        motor_velocity=np.zeros((40, 1)),
        command=np.zeros((40, 1)),
        force=np.full((40, 1), 0.01),
    )
    assert np.abs(missing_force(still, SERVO)).max() < 6e-3


def test_a_network_learns_what_is_missing_when_it_is_asked_again(motion: Recording) -> None:
    """Of commands at 20 Hz in a log at 80 Hz, the fourth row tells; the late first ones do not."""
    assert motion.command is not None
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
    servo = Servo.of(law)
    motor = 7.0
    pulling = motor / 1.3 - servo.dry_friction
    yielding = (motor / 1.3 + servo.dry_friction) / (1.0 - servo.held_share)
    assert pulling == pytest.approx((motor - 1.2) / 1.3)
    assert yielding == pytest.approx((motor + 1.2) / 0.7)


def test_the_servos_limit_counts_where_it_winds_in(motion: Recording) -> None:
    """A load cell sees 21 N at most while the shaft winds in, whatever the gear's friction."""
    assert motion.command is not None
    far = replace(motion, command=motion.command + 10.0)
    pulling, _ = ServoForce(far, SERVO)(np.zeros(400))
    np.testing.assert_allclose(pulling, 21.0, rtol=1e-6)


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
