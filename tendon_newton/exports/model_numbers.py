"""Numbers of a model as programs with a servo, a spool and a string ask for them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.export_target import Coverage
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.simulation.model.parameter_table import (
    ParameterTable,
    force_limit_of,
    spool_radius_of,
)
from tendon_newton.simulation.model.structure import in_catalogue_order


@dataclass(frozen=True, kw_only=True)
class ServoGains:
    """A servo as a position loop at its shaft."""

    kp: float  # [N m/rad]
    kd: float  # Damping of its motor or its loop [N m s/rad]
    lost: float  # Viscous friction [N m s/rad]
    limit: float  # Greatest torque [N m]


def refuse_damaged(model: Model, forceful: str | None = None) -> None:
    """Refuse a number that is missing or out of range, before anything is written.

    An effect of one servo is refused too: exported servos are all alike. So is an actuator without
    a force, where the target that needs one is named.
    """
    if forceful and find_actuator(model.actuator.name).kinematic:
        raise InvalidModelFile(
            f"{forceful} needs an actuator that gives a force; {model.actuator.name!r} only moves "
            "its shaft: such servos of a shaft or an arm go to mujoco, usd, urdf"
        )
    for effect in model.effects:
        if effect.servo is not None:
            raise InvalidModelFile(
                f"an exported model has the same effects at all servos; {effect.name!r} is of "
                f"servo {effect.servo} alone: simulate it here, or leave its key servo out"
            )
    names = in_catalogue_order(tuple(effect.name for effect in model.effects))
    table = ParameterTable(actuator=model.actuator.name, effects=names)
    if not find_actuator(model.actuator.name).held:  # a network's card fills in what is missing
        table.vector(model)
    spool_radius_of(model)


FURTHER_SENSORS = tuple(n for n, e in EFFECTS.items() if e.further_signals())
"""Effects of sensors beside encoder and load cell, whose readings no target shows."""


def coverage_of(exact: tuple[str, ...], nearly: tuple[str, ...]) -> dict[str, Coverage]:
    """Return what becomes of every effect: those named, and of all others nothing."""
    return {
        **dict.fromkeys(EFFECTS, "none"),
        **dict.fromkeys(exact, "exact"),
        **dict.fromkeys(nearly, "approximate"),
    }


def nearly(model: Model, coverage: Mapping[str, Coverage]) -> tuple[str, ...]:
    """Return the effects of a model that a way of running it has in another form."""
    return tuple(e.name for e in model.effects if coverage[e.name] == "approximate")


def not_exact(model: Model, coverage: Mapping[str, Coverage]) -> tuple[str, ...]:
    """Return the effects of a model that a way of running it does not have as they are."""
    return tuple(e.name for e in model.effects if coverage[e.name] != "exact")


def number(model: Model, effect: str, parameter: str) -> float:
    """Return a number of an effect, its null value where the model does not have it."""
    for entry in model.effects:
        if entry.name == effect:
            return float(entry.values[parameter])
    return next(p.null for p in find_effect(effect).parameters if p.name == parameter)


def spool_of(tendon: Tendon, model: Model) -> float:
    """Return the radius [m] of the spool as the string meets it."""
    radius = spool_radius_of(model)
    nominal = tendon.spool_radius if radius is None else radius
    return nominal * number(model, "spool_radius_error", "scale")


def command_span(mechanism: Mechanism) -> tuple[float, float]:
    """Return motor angles [rad] between which a bench moves without leaning on its stops."""
    tendon = mechanism.tendons[0]
    if not all(math.isfinite(joint.limits[1]) for joint in mechanism.joints):
        return (-0.5, 0.5)
    upper = np.array([joint.limits[1] for joint in mechanism.joints])
    reach = float(np.abs(tendon.moment_arm) @ upper)
    return (0.0, 1.5 * reach / tendon.spool_radius)


def angle_shift(tendon: Tendon, model: Model, offset: float) -> float:
    """Return the motor angle [rad] at which MuJoCo's tendon has no length."""
    wound = offset + number(model, "tendon_slack", "length")
    return wound / spool_of(tendon, model) + number(model, "position_offset", "angle")


def command_lead(model: Model) -> float:
    """Return the angle [rad] that a duty at no error stands for."""
    offset = model.actuator.values.get("duty_offset", 0.0)
    if not offset:
        return 0.0
    gain = float(model.actuator.values["duty_per_rad"]) * number(model, "gain_error", "scale")
    return float(offset) / gain


def motor_limit(tendon: Tendon, model: Model) -> float:
    """Return the greatest force [N] of a motor."""
    own = force_limit_of(model) or tendon.force_limit
    return min(own, number(model, "force_saturation", "limit"))


def dry_friction(model: Model) -> tuple[float, float]:
    """Return the dry friction [N] of a servo that slides, and that of one that sticks."""
    ways = [number(model, "asymmetric_friction", way) for way in ("winding", "unwinding")]
    plain = number(model, "coulomb_friction", "force") + 0.5 * sum(ways)
    slides = plain + number(model, "stribeck_friction", "coulomb_force")
    return slides, plain + number(model, "stribeck_friction", "static_force")


def servo_gains(tendon: Tendon, model: Model) -> ServoGains:
    """Return the loop of a servo that is no network."""
    radius = spool_of(tendon, model)
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    scale = number(model, "gain_error", "scale")
    limit = motor_limit(tendon, model) * radius
    if model.actuator.name == "ideal":
        kp, kd = values["gain"] * scale * radius, 0.0
    elif model.actuator.name == "pd_torque":
        kp, kd = values["kp"] * scale, values["kd"]
        limit = min(limit, values["max_torque"])
    else:
        constant, resistance = values["torque_constant"], values["resistance"]
        kp = values["duty_per_rad"] * scale * values["supply_voltage"] * constant / resistance
        kd = constant**2 / resistance
    lost = number(model, "viscous_friction", "coefficient") * radius
    return ServoGains(kp=kp, kd=kd, lost=lost, limit=limit)
