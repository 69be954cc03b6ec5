"""What a servo's model lacks of the measured tension, along measured motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.cards.force_network_card import HoldLaw
from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_train.actuator.samples.servo_law import ServoLaw
from tendon_train.actuator.training_config import SERVO_LIMIT

MOST_LOAD_FRICTION = 0.8
"""Greatest load friction of a servo's law [1]: with more it would not be driven backwards."""
SLACK = 0.1
"""Tension below which a tendon may be slack [N]: nothing is missing where none is asked for."""
SLIDING = 0.1  # Speed from which a shaft counts as turning [rad/s]: half a step of its register


@dataclass(frozen=True, kw_only=True)
class MeasuredServo:
    r"""A servo by what it gives while it winds in, and by what its gear holds beyond that.

    .. math:: F = P (\theta_d - \theta) - D \dot\theta - c \text{ while winding in}, \qquad
        F = \frac{P (\theta_d - \theta) - D \dot\theta + c}{1 - \eta} \text{ while yielding}

    and at rest anything between. The servo's limit counts where it winds in: that is the most that
    a load cell sees, while friction in proportion to the load would take its part of the limit.
    """

    stiffness: float  # P [N/rad]
    damping: float  # D [N s/rad]
    dry_friction: float  # c [N]
    held_share: float  # eta [1]

    @staticmethod
    def of(law: ServoLaw) -> MeasuredServo:
        """Return the same servo as a law with friction both ways, in proportion to the load."""
        load = min(law.load_friction, MOST_LOAD_FRICTION)
        return MeasuredServo(
            stiffness=law.stiffness / (1.0 + load),
            damping=law.damping / (1.0 + load),
            dry_friction=law.dry_friction / (1.0 + load),
            held_share=2.0 * load / (1.0 + load),
        )

    @property
    def frictions(self) -> tuple[NamedValues, ...]:
        """Return the frictions of the law as effects."""
        return (
            NamedValues(name="coulomb_friction", values={"force": self.dry_friction}),
            NamedValues(name="holding_friction", values={"share": self.held_share}),
        )

    @property
    def hold(self) -> HoldLaw:
        """How its force answers to the shaft between two queries of a network."""
        return HoldLaw(stiffness=self.stiffness, damping=self.damping)


def missing_force(recording: Recording, servo: MeasuredServo) -> Array:
    """Return what the motor's force lacks for the measured tension [N], shape (T,).

    While the motor turns, friction has one direction and one force is right. While it stands,
    friction takes any value between what sliding in and sliding out would give, and the force
    that lacks least is taken.

    Args:
        recording: A recording with one tendon, its command and its tension.
        servo: What is known of the servo.
    """
    assert recording.command is not None
    assert recording.force is not None
    angle, speed = recording.motor_position[:, 0], recording.motor_velocity[:, 0]
    measured = np.clip(recording.force[:, 0], 0.0, SERVO_LIMIT)
    motor = servo.stiffness * (recording.command[:, 0] - angle) - servo.damping * speed
    pulling = measured + servo.dry_friction - motor
    yielding = (1.0 - servo.held_share) * measured - servo.dry_friction - motor
    standing = np.clip(0.0, yielding, pulling)
    found = np.where(speed > SLIDING, pulling, np.where(speed < -SLIDING, yielding, standing))
    return np.where(measured < SLACK, np.minimum(found, 0.0), found)
