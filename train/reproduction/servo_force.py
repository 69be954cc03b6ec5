"""What a model's servo lacks of the measured tension, along the measured motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.data.cards.force_network_card import HoldLaw
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.device_code.placeholders import (
    DeviceArray,
    Jet,
    JointVector,
    ParameterVector,
    Placeholder,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.kernel_types import kernel_types
from tendon_newton.simulation.tendons.pipeline import flow_at
from tendon_newton.simulation.tendons.world_drive import world_drive
from train.actuator.samples.servo_law import ServoLaw
from train.reproduction.physical import SPOOL_RADIUS

Mechanism = Placeholder

RAIL = "spring_weak"
"""A bench whose excursion is its only coordinate, so that any measured motion can be put on it."""
MOST_LOAD_FRICTION = 0.8
"""Of a servo's law [1]: a gear that loses more would not be driven backwards."""
SEARCHED = 42.0
"""Greatest force that may be missing [N]: twice what the servo gives."""
HALVINGS = 14
"""Of the interval in which it is sought: down to 5 mN."""
SLACK = 0.1
"""Tension below which a tendon may be slack [N]: nothing is missing where none is asked for."""
SLIDING = 0.1
"""Speed from which a shaft counts as turning [rad/s]: half a step of its register."""


@dataclass(frozen=True, kw_only=True)
class Servo:
    r"""A servo by what it gives while it winds in, and by what its gear holds beyond that.

    .. math:: F = P (\theta_d - \theta) - D \dot\theta - c \text{ while winding in}, \qquad
        F = \frac{P (\theta_d - \theta) - D \dot\theta + c}{1 - \eta} \text{ while yielding}

    and at rest anything between. The servo's limit counts where it winds in: that is the most that
    a load cell sees, while friction in proportion to the load would take its part of the limit.
    """

    stiffness: float
    """P [N/rad]"""
    damping: float
    """D [N s/rad]"""
    dry_friction: float
    """c [N]"""
    held_share: float
    """eta [1]"""

    @staticmethod
    def of(law: ServoLaw) -> Servo:
        """Return the same servo as a law with friction both ways, in proportion to the load."""
        load = min(law.load_friction, MOST_LOAD_FRICTION)
        return Servo(
            stiffness=law.stiffness / (1.0 + load),
            damping=law.damping / (1.0 + load),
            dry_friction=law.dry_friction / (1.0 + load),
            held_share=2.0 * load / (1.0 + load),
        )

    @property
    def frictions(self) -> tuple[NamedValues, ...]:
        """Its frictions as effects."""
        return (
            NamedValues(name="coulomb_friction", values={"force": self.dry_friction}),
            NamedValues(name="holding_friction", values={"share": self.held_share}),
        )

    @property
    def hold(self) -> HoldLaw:
        """How its force answers to the shaft between two queries of a network."""
        return HoldLaw(stiffness=self.stiffness, damping=self.damping)


@device_template
def tension_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    command: DeviceArray[real],
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    pulling: DeviceArray[Jet],
    yielding: DeviceArray[Jet],
) -> None:
    """Write the tension [N] while the tendon slides in, and while it slides out."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    drive = world_drive(mechanism, 0, parameters[0])
    drive.command[0] = command[i]
    inwards = flow_at(mechanism, 0, parameters[0], drive, 0, q[i], v[i], real(1.0))
    outwards = flow_at(mechanism, 0, parameters[0], drive, 0, q[i], v[i], real(-1.0))
    pulling[i] = inwards.tension
    yielding[i] = outwards.tension


def missing_force(recording: Recording, servo: Servo) -> Array:
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
    measured, speed = recording.force[:, 0], recording.motor_velocity[:, 0]
    tensions = ServoForce(recording, servo)
    least, most = (np.full_like(measured, side * SEARCHED) for side in (-1.0, 1.0))
    inwards, outwards = [least, most], [least.copy(), most.copy()]
    for _ in range(HALVINGS):
        middle = [0.5 * (low + high) for low, high in (inwards, outwards)]
        pulling, yielding = tensions(middle[0])[0], tensions(middle[1])[1]
        for bounds, at, tension in (
            (inwards, middle[0], pulling),
            (outwards, middle[1], yielding),
        ):
            low = tension < measured
            bounds[0], bounds[1] = np.where(low, at, bounds[0]), np.where(low, bounds[1], at)
    for_pulling, for_yielding = inwards[1], outwards[1]
    standing = np.clip(0.0, for_yielding, for_pulling)
    found = np.where(
        speed > SLIDING, for_pulling, np.where(speed < -SLIDING, for_yielding, standing)
    )
    return np.where(measured < SLACK, np.minimum(found, 0.0), found)


@lru_cache(maxsize=1)
def on_rail(effects: tuple[str, ...]) -> Rollout:
    """Return a rail pulled by an ideal source; to build it takes longer than all that is asked."""
    nothing = np.zeros((2, 1))
    rest = Recording(
        name="rest",
        bench=RAIL,
        time=np.arange(2) / 80.0,
        motor_position=nothing,
        motor_velocity=nothing,
        command=nothing,
    )
    return Rollout(
        load_mechanism(RAIL), [rest], actuator="ideal", effects=effects, spool_radius=SPOOL_RADIUS
    )


class ServoForce:
    """Tensions of a servo along a recording, for any force that is added to its motor's.

    Args:
        recording: A recording with one tendon and a command.
        servo: What is known of the servo.
    """

    def __init__(self, recording: Recording, servo: Servo) -> None:
        assert recording.command is not None
        values = {"gain": servo.stiffness, "spool_radius": SPOOL_RADIUS}
        model = Model(actuator=NamedValues(name="ideal", values=values), effects=servo.frictions)
        rollout = on_rail(tuple(effect.name for effect in servo.frictions))
        structure, types = rollout.kernels.structure, rollout.kernels.types
        self._kernel = assemble(structure, kernel_types(structure)).kernel(tension_kernel)
        self._rollout = rollout
        self._servo = servo
        braked = servo.damping / servo.stiffness * recording.motor_velocity[:, 0]
        self._command = recording.command[:, 0] - braked
        self._vectors = rollout.array(rollout.base_vectors(model), types["ParameterVector"])
        self._motion = [
            rollout.array(SPOOL_RADIUS * signal, types["JointVector"])
            for signal in (recording.motor_position, recording.motor_velocity)
        ]

    def __call__(self, added: Array) -> tuple[Array, Array]:
        """Return the tensions [N] of sliding in and of sliding out, shapes (T,).

        Args:
            added: Force [N] that comes to the motor's, shape (T,).
        """
        rollout, types = self._rollout, self._rollout.kernels.types
        command = rollout.array(self._command + added / self._servo.stiffness, types["real"])
        out: list[Any] = [
            wp.zeros(len(added), dtype=types["Jet"], device=rollout.device) for _ in range(2)
        ]
        wp.launch(
            self._kernel,
            len(added),
            inputs=[rollout.numbers, self._vectors, command, *self._motion],
            outputs=out,
            device=rollout.device,
        )
        pulling, yielding = (signal.numpy()[:, 0] for signal in out)
        return pulling, yielding
