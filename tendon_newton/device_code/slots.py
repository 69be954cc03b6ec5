"""Functions that are chosen when a kernel is assembled: the effects of each stage, and a few more.

Device code calls them like any function; `simulation.model.assembly` says what stands for each. A
stage's slot applies, one after the other, the device functions that the effects of a model have
under the stage's name, such as `CoulombFriction.tension` for `tension_effects`.
"""

# what they return is said where they are bound
# pyright: reportReturnType=false

from collections.abc import Callable
from typing import Any, TypeVar

from tendon_newton.device_code.placeholders import (
    Jet,
    JointVector,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.structs import (
    ChainTerms,
    ContactPose,
    ContactTerms,
    Drive,
    Forces,
    Joint,
    JointPose,
    Mechanism,
    Routes,
    Tendon,
)

Function = TypeVar("Function", bound=Callable[..., Any])


def slot(signature: Function) -> Function:
    """Mark a signature as a slot."""
    return signature


# --- stages: numbers that neither position nor speed decides


@slot
def period_effects(scale: real, p: ParameterVector) -> real:
    """Seconds that pass in one second of the log's clock [1]."""


@slot
def clock_effects(time: real, d: int, p: ParameterVector) -> real:
    """The instant [s] at which servo d reads the command."""


@slot
def radius_effects(radius: real, d: int, p: ParameterVector) -> real:
    """The radius of spool d [m]."""


@slot
def string_effects(stiffness: real, d: int, p: ParameterVector) -> real:
    """The stiffness of string d [N/m], where its spool has a coordinate of its own."""


@slot
def speed_effects(limit: real, d: int, p: ParameterVector) -> real:
    """The greatest speed of motor d [rad/s]."""


@slot
def inertia_effects(scale: real, p: ParameterVector) -> real:
    """How much more than their weight the links resist [1]."""


@slot
def tilt_effects(angle: real, p: ParameterVector) -> real:
    """How far the bench is tipped about +y [rad]."""


@slot
def joint_friction_effects(limit: real, joint: Joint, p: ParameterVector) -> real:
    """A joint's dry friction [N m]."""


@slot
def cell_clock_effects(time: real, d: int, p: ParameterVector) -> real:
    """The instant [s] whose force load cell d reports."""


@slot
def cell_lag_effects(time_constant: real, d: int, p: ParameterVector) -> real:
    """The own lag of load cell d [s]."""


@slot
def cell_effects(force: real, time: real, d: int, p: ParameterVector) -> real:
    """What load cell d makes of a force [N]."""


# --- stages: signals along a tendon


@slot
def stretch_effects(length: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """String wound on the spool [m]."""


@slot
def angle_effects(angle: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The motor angle [rad] that the servo acts on."""


@slot
def error_effects(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The position error [rad] that the servo acts on."""


@slot
def duty_effects(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The share of all that it has which the servo gives [1]: duty cycle, or force over limit."""


@slot
def motor_force_effects(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The motor's force at the spool [N], pulling or pushing, after the servo's own limit."""


@slot
def spool_force_effects(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """What the spool gives its string of the motor's force [N]."""


@slot
def sliding_effects(side: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """By what share of its dry friction a tendon's bristles are bent, and to which side [1]."""


@slot
def tension_effects(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """What dry friction leaves of that at the load cell [N]."""


@slot
def line_effects(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """What a string that stretches carries at its load cell [N], behind a rotor."""


@slot
def transmission_effects(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """What reaches the mechanism [N]."""


@slot
def encoder_effects(angle: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The angle [rad] reported, given `tendon.tension`."""


# --- stages: torques of a joint


@slot
def spring_effects(torque: Jet, joint: Joint, p: ParameterVector) -> Jet:
    """A joint's return spring [N m]."""


@slot
def damping_effects(torque: Jet, joint: Joint, p: ParameterVector) -> Jet:
    """A joint's viscous damping [N m]."""


# --- what effects remember after a stage


@slot
def error_memory(
    error: Jet, tendon: Tendon, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember the position error."""


@slot
def duty_memory(
    duty: Jet, tendon: Tendon, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember the servo's duty."""


@slot
def motor_force_memory(
    force: Jet, tendon: Tendon, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember the motor's force."""


@slot
def tension_memory(
    force: Jet, tendon: Tendon, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember what friction leaves."""


@slot
def line_memory(
    force: Jet, tendon: Tendon, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember how a string lies in its guides."""


@slot
def spring_memory(
    torque: Jet, joint: Joint, p: ParameterVector, memory: MemoryVector
) -> MemoryVector:
    """A memory renewed by the effects that remember a joint's spring."""


# --- an angle's effects where positions alone are known


@slot
def play_effects(angle: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The drive's angle [rad] that belongs to a shaft's: what lies between drive and shaft."""


@slot
def offset_effects(angle: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The angle [rad] that the encoder reports of a shaft's."""


# --- what is no effect


@slot
def actuator_force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The actuator's force at the spool [N], before the servo's limit."""


@slot
def asked_duty(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The share of all that it has which the actuator asks for [1]."""


@slot
def driven_force(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """The actuator's force at such a share [N], before the servo's limit."""


@slot
def motor_current(force: real, tendon: Tendon, p: ParameterVector) -> real:
    """Return the motor's current [A] while it gives a force at its spool [N]."""
    return real(0.0)


@slot
def armature(p: ParameterVector) -> real:
    """Inertia of rotor and gear at the spool [kg m2]."""


@slot
def chain_terms(mechanism: Mechanism, here: Drive) -> ChainTerms:
    """Mass matrix, and torque of gravity and velocities, of a chain in a plane or in space."""


@slot
def all_routes(mechanism: Mechanism, world: int, pose: JointPose) -> Routes:
    """Lengths of all tendons' spans and their derivatives by the joints."""


@slot
def contact_pose(mechanism: Mechanism, world: int, q: JointVector) -> ContactPose:
    """Where joints and capsules are, of a chain in a plane or in space."""


@slot
def contact_terms(mechanism: Mechanism, here: Drive) -> ContactTerms:
    """Joint torques of all contacts, and their derivatives."""


@slot
def with_body_terms(mechanism: Mechanism, here: Drive, chain: ChainTerms) -> ChainTerms:
    """Mass matrix and torque of a chain and its free body."""


@slot
def with_still_body(forces: Forces) -> Forces:
    """Forces in which the free body stays where it is."""


@slot
def contact_memory(mechanism: Mechanism, here: Drive, memory: MemoryVector) -> MemoryVector:
    """A memory renewed by the contacts."""
