"""The stages between a command and the tendon's pull, and between a joint's state and its torque.

clock -> angle -> error -> [actuator] -> motor force -> [servo's limit] -> tension -> [a string cannot push] -> transmission

Each name without brackets is a slot for effects (`tendon_newton.effects.base.Stage`); a kernel holds only those that its model
lists. Forces travel as jets, so that the integrator gets the derivatives it needs without finite differences.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import Jet, ParameterVector, TendonVector, Values, real
from tendon_newton.device_code.templates import device_template

Drive: Any = None
Joint: Any = None
Tendon: Any = None
Mechanism: Any = None
FUNCTIONS: tuple[Any, ...] = ()
OFFSETS: tuple[int, ...] = ()
actuator_force: Any = None
angle_effects: Any = None
error_effects: Any = None
motor_force_effects: Any = None
tension_effects: Any = None
transmission_effects: Any = None
spring_effects: Any = None
damping_effects: Any = None


@device_template
def clock_stage(time: real, p: ParameterVector) -> real:
    """Apply the effects of one scalar stage in order."""
    for i in range(wp.static(len(FUNCTIONS))):
        time = wp.static(FUNCTIONS[i])(time, own_values(p, wp.static(OFFSETS[i])))
    return time


@device_template
def joint_stage(torque: Jet, joint: Joint, p: ParameterVector) -> Jet:
    """Apply the effects of one joint stage in order."""
    for i in range(wp.static(len(FUNCTIONS))):
        torque = wp.static(FUNCTIONS[i])(torque, joint, own_values(p, wp.static(OFFSETS[i])))
    return torque


@device_template
def tendon_stage(signal: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Apply the effects of one tendon stage in order."""
    for i in range(wp.static(len(FUNCTIONS))):
        signal = wp.static(FUNCTIONS[i])(signal, tendon, own_values(p, wp.static(OFFSETS[i])))
    return signal


@device_template
def own_values(p: ParameterVector, offset: int) -> Values:
    """Return the parameters of the effect that starts at an offset; the vector ends in two zeros of padding."""
    return Values(p[offset], p[offset + 1], p[offset + 2])


@device_template
def clip(signal: Jet, lower: real, upper: real) -> Jet:
    """Limit a jet; beyond a bound its derivatives vanish."""
    out = signal
    if signal[0] < lower:
        out = Jet(lower, real(0.0), real(0.0))
    if signal[0] > upper:
        out = Jet(upper, real(0.0), real(0.0))
    return out


@device_template
def tendon_state(
    mechanism: Mechanism, world: int, drive: Drive, d: int, length: real, rate: real
) -> Tendon:
    """Describe tendon d at an excursion [m] and its rate [m/s]."""
    radius = mechanism.spool_radius[world][d]
    tendon = Tendon()
    tendon.time = drive.time
    tendon.voltage = drive.voltage
    tendon.enabled = drive.enabled
    tendon.spool_radius = radius
    tendon.velocity = rate
    tendon.direction = real(1.0)
    if rate < real(0.0):
        tendon.direction = real(-1.0)
    tendon.angle = Jet(length / radius, real(1.0) / radius, real(0.0))
    tendon.angle_rate = Jet(rate / radius, real(0.0), real(1.0) / radius)
    return tendon


@device_template
def motor_force(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, d: int, tendon: Tendon
) -> Jet:
    """Return the force of the motor at the spool [N], before friction, limited to what the servo can give."""
    angle = angle_effects(tendon.angle, tendon, p)
    error = Jet(drive.command[d], real(0.0), real(0.0)) - angle
    error = error_effects(error, tendon, p)
    force = actuator_force(error, tendon, p)
    force = motor_force_effects(force, tendon, p)
    limit = mechanism.force_limit[world][d]
    return clip(force, -limit, limit)


@device_template
def tension(
    mechanism: Mechanism, world: int, p: ParameterVector, d: int, force: Jet, tendon: Tendon
) -> Jet:
    """Return the tension at the load cell [N], friction opposing the tendon's direction of motion."""
    least = mechanism.least_tension[world][d]
    out = tension_effects(force, tendon, p)
    if out[0] < least:
        out = Jet(least, real(0.0), real(0.0))
    return out


@device_template
def spring_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's return spring [N m]."""
    torque = Jet(
        -joint.stiffness * (joint.position - joint.rest), -joint.stiffness, real(0.0)
    )
    return spring_effects(torque, joint, p)


@device_template
def damping_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's viscous damping [N m]."""
    torque = Jet(-joint.damping * joint.velocity, real(0.0), -joint.damping)
    return damping_effects(torque, joint, p)
