"""What a model's servo lacks of the measured tension, along the measured motion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.device_code.placeholders import (
    DeviceArray,
    Jet,
    JointVector,
    ParameterVector,
    Placeholder,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects import Stage, find_effect
from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.model_file import Model, NamedValues
from tendon_newton.recording import Array, Recording
from tendon_newton.simulation.assembly import assemble
from tendon_newton.simulation.kernel_types import kernel_types
from tendon_newton.simulation.pipeline import flow_at
from tendon_newton.simulation.rollout import Rollout
from tendon_newton.simulation.world_drive import world_drive

Mechanism = Placeholder

RAIL = "spring_weak"
"""A bench whose excursion is its only coordinate, so that any measured motion can be put on it."""
VISCOUS = "viscous_friction"
SEARCHED = 42.0
"""Greatest force that may be missing [N]: twice what the servo gives."""
HALVINGS = 14
"""Of the interval in which it is sought: down to 5 mN."""
SLACK = 0.1
"""Tension below which a tendon may be slack [N]: nothing is missing where none is asked for."""
SLIDING = 0.1
"""Speed from which a shaft counts as turning [rad/s]: half a step of its register."""


def servo_of(model: Model) -> Model:
    """Return the servo of a model as an ideal source with frictions behind it.

    A gain error becomes part of the gain, and back-EMF is viscous friction. What else acts on the
    command, on the position error or on the motor's force is left out, and so is all that comes
    after the load cell.
    """
    numbers = {k: float(v) for k, v in model.actuator.values.items() if k != "file"}
    named = {effect.name: effect.values for effect in model.effects}
    gain, damping = numbers.get("gain", 0.0), 0.0
    if model.actuator.name == "pwm_servo":
        pull = numbers["torque_constant"] / (numbers["resistance"] * numbers["spool_radius"])
        gain = numbers["duty_per_rad"] * numbers["supply_voltage"] * pull
        damping = numbers["torque_constant"] * pull
    gain *= float(named.get("gain_error", {}).get("scale", 1.0))
    damping += float(named.get(VISCOUS, {}).get("coefficient", 0.0))
    (declared,) = find_effect(VISCOUS).parameters
    frictions = [NamedValues(name=VISCOUS, values={"coefficient": min(damping, declared.upper)})]
    frictions += [e for e in model.effects if e.name != VISCOUS and is_friction(e.name)]
    values = {"gain": gain, "spool_radius": numbers["spool_radius"]}
    return Model(actuator=NamedValues(name="ideal", values=values), effects=tuple(frictions))


def is_friction(effect: str) -> bool:
    """Tell whether an effect takes from the motor's force before the load cell."""
    declared = find_effect(effect)
    return declared.side == "actuator" and declared.hook(Stage.TENSION) is not None


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


def missing_force(recording: Recording, servo: Model) -> Array:
    """Return what the motor's force lacks for the measured tension [N], shape (T,).

    While the motor turns, friction has one direction and one force is right. While it stands,
    friction takes any value between what sliding in and sliding out would give, and the force
    that lacks least is taken.

    Args:
        recording: A recording with one tendon, its command and its tension.
        servo: As `servo_of` makes it.
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
            (inwards, middle[0], pulling), (outwards, middle[1], yielding),
        ):  # fmt: skip
            low = tension < measured
            bounds[0], bounds[1] = np.where(low, at, bounds[0]), np.where(low, bounds[1], at)
    for_pulling, for_yielding = inwards[1], outwards[1]
    standing = np.clip(0.0, for_yielding, for_pulling)
    found = np.where(
        speed > SLIDING, for_pulling, np.where(speed < -SLIDING, for_yielding, standing)
    )
    return np.where(measured < SLACK, np.minimum(found, 0.0), found)


class ServoForce:
    """Tensions of a servo along a recording, for any force that is added to its motor's.

    Args:
        recording: A recording with one tendon and a command.
        servo: As `servo_of` makes it.
    """

    def __init__(self, recording: Recording, servo: Model) -> None:
        assert recording.command is not None
        radius, self._gain = (float(servo.actuator.values[k]) for k in ("spool_radius", "gain"))
        on_rail = replace(recording, bench=RAIL, tip=None, extra={})
        rollout = Rollout(
            load_mechanism(RAIL), [on_rail], actuator=servo.actuator.name,
            effects=[effect.name for effect in servo.effects], spool_radius=radius,
        )  # fmt: skip
        structure, types = rollout.kernels.structure, rollout.kernels.types
        self._kernel = assemble(structure, kernel_types(structure)).kernel(tension_kernel)
        self._rollout = rollout
        self._command = recording.command[:, 0]
        self._vectors = rollout.array(rollout.base_vectors(servo), types["ParameterVector"])
        self._motion = [
            rollout.array(radius * signal, types["JointVector"])
            for signal in (recording.motor_position, recording.motor_velocity)
        ]

    def __call__(self, added: Array) -> tuple[Array, Array]:
        """Return the tensions [N] of sliding in and of sliding out, shapes (T,).

        Args:
            added: Force [N] that comes to the motor's, shape (T,).
        """
        rollout, types = self._rollout, self._rollout.kernels.types
        command = rollout.array(self._command + added / self._gain, types["real"])
        out: list[Any] = [
            wp.zeros(len(added), dtype=types["Jet"], device=rollout.device) for _ in range(2)
        ]
        wp.launch(
            self._kernel, len(added),
            inputs=[rollout.numbers, self._vectors, command, *self._motion], outputs=out,
            device=rollout.device,
        )  # fmt: skip
        pulling, yielding = (signal.numpy()[:, 0] for signal in out)
        return pulling, yielding
