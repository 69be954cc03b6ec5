"""What a servo's model lacks of a tension, against tensions of a known servo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from tendon_newton.model_file import Model, NamedValues
from tendon_newton.recording import Array, Recording
from tests.physics.networks import force_network
from train.reproduction.hybrid import CorrectedSource, hybrid_model
from train.reproduction.physical import DATA_SHEET, starting_model
from train.reproduction.servo_force import ServoForce, missing_force, servo_of

LOAD = NamedValues(name="load_dependent_friction", values={"coefficient": 0.3})
SERVO = Model(
    actuator=NamedValues(name="ideal", values={"gain": 5.0, "spool_radius": 0.0125}),
    effects=(NamedValues(name="viscous_friction", values={"coefficient": 2.0}), LOAD),
)


@pytest.fixture
def motion() -> Recording:
    """A slow sinusoid of the shaft behind a command that leads it, with rests."""
    time = np.arange(400) / 80.0
    angle = 1.0 + 0.5 * np.clip(1.3 * np.sin(2.0 * time), -1.0, 1.0)
    return Recording(
        name="motion", bench="finger", time=time, motor_position=angle[:, None],
        motor_velocity=np.gradient(angle, time)[:, None], command=angle[:, None] + 1.2,
        force=np.zeros((400, 1)),
    )  # fmt: skip


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
        name="slack", bench="finger", time=time, motor_position=np.ones((40, 1)),
        motor_velocity=np.zeros((40, 1)), command=np.zeros((40, 1)), force=np.full((40, 1), 0.01),
    )  # fmt: skip
    assert np.abs(missing_force(still, SERVO)).max() < 6e-3


def test_a_motor_is_an_ideal_source_with_viscous_friction() -> None:
    """Gain and back-EMF follow from the data sheet; the friction stays within its range."""
    model = replace(
        starting_model(),
        effects=(LOAD, NamedValues(name="tendon_compliance", values={"stiffness": 8e3})),
    )
    servo = servo_of(model)
    pull = DATA_SHEET["torque_constant"] / (DATA_SHEET["resistance"] * 0.0125)
    assert servo.actuator.values["gain"] == pytest.approx(0.1 * 9.0 * pull)
    assert [e.name for e in servo.effects] == ["viscous_friction", "load_dependent_friction"]
    assert servo.effects[0].values["coefficient"] == pytest.approx(min(1.43 * pull, 20.0))


def test_a_hybrid_keeps_what_lies_behind_the_load_cell(tmp_path) -> None:
    """The network takes the place of the servo's source; its frictions and the tendon stay."""
    compliance = NamedValues(name="tendon_compliance", values={"stiffness": 8e3})
    delay = NamedValues(name="command_delay", values={"delay": 0.02})
    physical = replace(starting_model(), effects=(delay, LOAD, compliance))
    model = hybrid_model(tmp_path / "net.pt", physical, servo_of(physical))
    assert model.actuator.name == "learned"
    assert [effect.name for effect in model.effects] == [
        "viscous_friction", "load_dependent_friction", "tendon_compliance",
    ]  # fmt: skip


def test_a_corrected_source_adds_its_share() -> None:
    """P (theta_d - theta) of the last sample, and half of what the network says."""
    network = force_network()
    window = torch.rand(3, network.window, 3)
    both = CorrectedSource(network, gain=4.0, share=0.5)(window)
    alone = 4.0 * (window[:, -1, 0] - window[:, -1, 1]) + 0.5 * network(window)
    torch.testing.assert_close(both, alone)
