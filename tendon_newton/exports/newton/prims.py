"""Actuator prims for Newton: its own drive and clamps where they say it, else ours."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.exports import model_numbers
from tendon_newton.exports.mujoco.mjcf_servo import FRICTION_SHAPE
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.mechanisms.usd.stage_file import take_units

ACTUATORS = "actuators"  # Name of the scope under the bench's default prim
LONGEST_STEP = 1.0e-4  # Default step [s]


@dataclass(frozen=True, kw_only=True)
class ActuatorPrim:
    """One `NewtonActuator`."""

    name: str
    joint: str  # Path of the joint that it drives
    schemas: tuple[str, ...]
    numbers: dict[str, Any]  # Attributes without their namespace


@dataclass(frozen=True, kw_only=True)
class Gearing:
    """How a joint's position and force follow from a motor's, where one tendon drives one joint."""

    ratio: float  # Motor angle per joint position [1] or [rad/m]
    shift: float  # Motor angle at joint position zero [rad]
    lead: float = 0.0  # What a servo adds to its command [rad]

    def target(self, command: Any) -> Any:
        """Return the joint position [rad, m] of a desired motor angle [rad]."""
        return (command + self.lead - self.shift) / self.ratio


def gearing_of(tendon: Tendon, model: Model) -> Gearing:
    """Return the gearing of a tendon that drives one joint."""
    (arm,) = tendon.moment_arm[tendon.moment_arm != 0.0]
    return Gearing(
        ratio=float(arm) / model_numbers.spool_of(tendon, model),
        shift=model_numbers.angle_shift(tendon, model, tendon.excursion_offset),
        lead=model_numbers.command_lead(model),
    )


def drives_one_joint(tendon: Tendon) -> bool:
    """Tell whether Newton's own actuators can drive what a tendon drives."""
    return tendon.route is None and np.count_nonzero(tendon.moment_arm) == 1


def own_prims(mechanism: Mechanism) -> list[ActuatorPrim]:
    """Return a prim of our drive for each joint that a tendon drives.

    The schema stands alone: beside one that USD knows, Newton's reader passes over any that USD
    does not know.
    """
    return [
        ActuatorPrim(
            name=f"{tendon.name}_{joint.name}",
            joint=joint.prim,
            schemas=("TendonDriveAPI",),
            numbers={"tendon": d, "joint": j},
        )
        for d, tendon in enumerate(mechanism.tendons)
        for j, joint in enumerate(mechanism.joints)
        if tendon.moment_arm[j] != 0.0
    ]


def plain_prims(mechanism: Mechanism, model: Model, step: float) -> list[ActuatorPrim] | None:
    """Return prims of Newton's own drive and clamps; None where these cannot say it."""
    known = model.actuator.name in ("ideal", "pwm_servo", "pd_torque")
    if not known or not all(drives_one_joint(tendon) for tendon in mechanism.tendons):
        return None
    steps = round(model_numbers.number(model, "command_delay", "delay") / step)
    late, delay = (("NewtonActuatorDelayAPI",), {"delaySteps": steps}) if steps else ((), {})
    out = []
    for tendon in mechanism.tendons:
        (j,) = np.flatnonzero(tendon.moment_arm)
        schemas, numbers = joint_drive(tendon, model)
        out.append(
            ActuatorPrim(
                name=tendon.name,
                joint=mechanism.joints[j].prim,
                schemas=(*schemas, *late),
                numbers={**numbers, **delay},
            )
        )
    return out


def joint_drive(tendon: Tendon, model: Model) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return Newton's drive and clamps for a servo that drives one joint.

    Torques and speeds at the spool become those at the joint by the gearing.
    """
    ratio = gearing_of(tendon, model).ratio
    gains = model_numbers.servo_gains(tendon, model)
    schemas = ("NewtonPDControlAPI", "NewtonMaxEffortClampingAPI")
    motor: dict[str, Any] = {}
    if model.actuator.name == "pwm_servo":
        values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
        constant, most = values["torque_constant"], values["max_duty"] * values["supply_voltage"]
        schemas = (schemas[0], "NewtonDCMotorClampingAPI", schemas[1])
        motor = {
            "saturationEffort": constant * most / values["resistance"] * abs(ratio),
            "velocityLimit": most / constant / abs(ratio),
        }
    numbers = {
        "kp": gains.kp * ratio**2,
        "kd": (gains.kd + gains.lost) * ratio**2,
        "maxEffort": gains.limit * abs(ratio),
    }
    return schemas, {**numbers, **motor}


def write_actuators(
    path: Path, bench: Path, prims: list[ActuatorPrim], joints: dict[str, dict[str, float]]
) -> None:
    """Write a layer with actuator prims above a bench.

    Numbers of joints that differ are given by path and attribute.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from pxr import Sdf, Usd, Vt

    stage = Usd.Stage.Open(str(bench))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.subLayerPaths.append(str(bench))
    top = Usd.Stage.Open(layer)
    root = stage.GetDefaultPrim().GetPath()
    for prim in stage.Traverse():
        if prim.GetTypeName() in ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint"):
            own = top.OverridePrim(prim.GetPath())
            shape = own.CreateAttribute("mjc:solimpfriction", Sdf.ValueTypeNames.DoubleArray)
            shape.Set(Vt.DoubleArray(FRICTION_SHAPE))
            for name, value in joints.get(str(prim.GetPath()), {}).items():
                own.CreateAttribute(name, Sdf.ValueTypeNames.Float, False).Set(value)
    for entry in prims:
        prim = top.DefinePrim(root.AppendPath(f"{ACTUATORS}/{entry.name}"), "NewtonActuator")
        schemas = Sdf.TokenListOp()
        schemas.prependedItems = list(entry.schemas)
        prim.SetMetadata("apiSchemas", schemas)
        prim.CreateRelationship("newton:targets", False).SetTargets([entry.joint])
        for name, value in entry.numbers.items():
            kind = Sdf.ValueTypeNames.Int if isinstance(value, int) else Sdf.ValueTypeNames.Float
            prim.CreateAttribute(f"newton:{name}", kind, False).Set(value)
    take_units(layer, stage)
    del top
    layer.subLayerPaths[0] = f"./{bench.name}"
    write_text(path, layer.ExportToString())
