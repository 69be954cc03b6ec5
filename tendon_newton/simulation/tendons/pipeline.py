r"""The stages between a command and the tendon's pull, and between a joint's state and its torque.

    clock -> error -> duty -> [actuator] -> [servo's limit] -> motor force -> tension
          -> [a string cannot push] -> transmission -> mechanism
    mechanism -> radius -> stretch -> angle -> error

Each name without brackets is a slot for effects (`tendon_newton.effects.base.Stage`); a kernel
holds only those that its model lists. Forces travel as jets, so that the integrator gets the
derivatives it needs without finite differences.

A rotor of inertia J takes its part before the gear and the load cell see the motor's force:
the tension is :math:`F = f(F_m - a\,\ddot s)`, with :math:`a = J / r^2` and f what the gear's
friction leaves of a force. Friction is linear in the force of a string that pulls, so that two
numbers say how much of the rotor is felt: `Flow.tension_gain` at the load cell, `Flow.pull_gain` at
the mechanism. Where the spool has a coordinate of its own, `spools` takes these apart.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    ArmMatrix,
    Jet,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow

Drive = Placeholder
Flow = Placeholder
Joint = Placeholder
Tendon = Placeholder
Mechanism = Placeholder
actuator_force: Any = None
radius_effects: Any = None
stretch_effects: Any = None
angle_effects: Any = None
error_effects: Any = None
error_memory: Any = None
duty_effects: Any = None
duty_memory: Any = None
asked_duty: Any = None
driven_force: Any = None
motor_force_effects: Any = None
motor_force_memory: Any = None
tension_effects: Any = None
tension_memory: Any = None
transmission_effects: Any = None
spring_effects: Any = None
damping_effects: Any = None
ROUTED = False
"""Whether any tendon's moment arms follow from its path."""
HAS_DUTY = False
"""Whether any effect acts on the share of all it has which a servo gives."""
HAS_ROTOR = False
"""Whether a rotor's inertia stands between the motor and the load cell."""
FREE_SPOOL = False
"""Whether each spool has a coordinate of its own."""

HELD = 1.0e6
"""Force [N] that no mechanism overcomes: what a motor at its greatest speed holds against."""
UNDECIDED, TAUT, SLACK = 0.0, 1.0, 2.0
"""Whether a string pulls: what its force says, or what was decided at the start of a step."""
PULLING = 1.0e-6
"""A force [N] whose sign is that of a string that pulls."""


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
def excursion(arms: ArmMatrix, d: int, x: JointVector) -> real:
    """Return the sum over joints of moment arm times joint coordinate, for tendon d."""
    total = real(0.0)
    for j in range(JOINTS):
        total = total + arms[d, j] * x[j]
    return total


@device_template
def tendon_state(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    side: real,
) -> Tendon:
    """Describe tendon d to the effects.

    Its side is +1 while it slides in and -1 while it slides out, +2 and -2 beyond the motor's
    speed; 0 leaves all friction out. The drive was located at q and v.
    """
    arms = tendon_arms(mechanism, world, drive)
    bow = tendon_bow(drive)
    tendon = Tendon()
    tendon.index = d
    tendon.time = drive.time
    tendon.elapsed = drive.elapsed
    tendon.memory = drive.memory
    tendon.voltage = drive.voltage
    tendon.enabled = drive.enabled
    tendon.slack = drive.slack[d]
    tendon.carried = drive.carried[d]
    tendon.command = drive.command[d]
    tendon.nominal_radius = mechanism.spool_radius[world][d]
    tendon.spool_radius = radius_effects(tendon.nominal_radius, p)
    if wp.static(ROUTED):
        tendon.length = drive.length[d]
    else:
        tendon.length = mechanism.excursion_offset[world][d] + excursion(arms, d, q)
    tendon.velocity = excursion(arms, d, v)
    tendon.acceleration = excursion(arms, d, drive.acceleration) + bow[d]
    tendon.wound = tendon.length
    if wp.static(FREE_SPOOL):
        tendon.wound = tendon.length + q[LINKS + d]
        tendon.velocity = tendon.velocity + v[LINKS + d]
        tendon.acceleration = tendon.acceleration + drive.acceleration[LINKS + d]
    tendon.side = side
    tendon.direction = wp.clamp(side, real(-1.0), real(1.0))
    tendon.inverse_radius = real(1.0) / tendon.spool_radius
    tendon.angle_rate = Jet(tendon.velocity, real(0.0), real(1.0)) * tendon.inverse_radius
    return tendon


@device_template
def tendon_flow(
    mechanism: Mechanism, world: int, p: ParameterVector, d: int, tendon: Tendon
) -> Flow:
    """Follow the signal from the encoder through servo and tendon to the mechanism."""
    flow = servo_flow(mechanism, world, p, d, tendon)
    least = mechanism.least_tension[world][d]
    acting = tendon
    acting.error = tendon.command - flow.angle[0]
    if wp.static(HAS_ROTOR):
        flow = rotor_flow(flow, acting, p, least)
    else:
        flow.tension = tension_effects(flow.motor_force, acting, p)
        flow.slack = tendon.slack
        if tendon.side * tendon.direction > real(1.5):
            flow.tension = Jet(-real(HELD) * tendon.direction, real(0.0), real(0.0))
            flow.slack = real(UNDECIDED)
        flow.line = flow.tension[0]
        if flow.slack == real(UNDECIDED):
            flow.slack = real(TAUT)
            if flow.tension[0] < least:
                flow.slack = real(SLACK)
        if flow.slack == real(SLACK):
            flow.tension = Jet(least, real(0.0), real(0.0))
        flow.pull = transmission_effects(flow.tension, acting, p)
    return flow


@device_template
def servo_flow(
    mechanism: Mechanism, world: int, p: ParameterVector, d: int, tendon: Tendon
) -> Flow:
    """Follow the signal from the encoder to the motor's force."""
    limit = mechanism.force_limit[world][d]
    length = stretch_effects(Jet(tendon.wound, real(1.0), real(0.0)), tendon, p)
    flow = Flow()
    flow.angle = angle_effects(length * tendon.inverse_radius, tendon, p)
    error = Jet(tendon.command, real(0.0), real(0.0)) - flow.angle
    acting = tendon
    acting.error = error[0]
    flow.error = error_effects(error, acting, p)
    if wp.static(HAS_DUTY):
        acting.force_limit = wp.min(limit, real(HELD))
        flow.duty = duty_effects(asked_duty(flow.error, acting, p), acting, p)
        force = clip(driven_force(flow.duty, acting, p), -limit, limit)
    else:
        force = clip(actuator_force(flow.error, acting, p), -limit, limit)
    flow.motor_force = motor_force_effects(force * tendon.enabled, acting, p)
    return flow


@device_template
def duty_of_force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the share of its limit that a servo's force would be [1]."""
    limit = tendon.force_limit
    return clip(actuator_force(error, tendon, p), -limit, limit) * (real(1.0) / limit)


@device_template
def force_of_duty(duty: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the force [N] that is a share of a servo's limit."""
    return duty * tendon.force_limit


@device_template
def gear_line(force: real, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what gear friction leaves of a force [N], its slope [1], its slope by v [N s/m]."""
    here = tension_effects(Jet(force, real(0.0), real(0.0)), tendon, p)
    ahead = tension_effects(Jet(force, real(1.0), real(0.0)), tendon, p)
    return Jet(here[0], ahead[1] - here[1], here[2])


@device_template
def guide_line(tension: real, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what reaches the mechanism of a tension [N], its slope [1], its slope by l [N/m]."""
    here = transmission_effects(Jet(tension, real(0.0), real(0.0)), tendon, p)
    ahead = transmission_effects(Jet(tension, real(1.0), real(0.0)), tendon, p)
    return Jet(here[0], ahead[1] - here[1], here[1])


@device_template
def rotor_flow(flow: Flow, tendon: Tendon, p: ParameterVector, least: real) -> Flow:
    """Follow the motor's force through gear and guides, and how much of the rotor they pass on.

    What the motor gives may be negative where a string still pulls, as its rotor slows down. So
    friction is taken as of a pulling force, and who knows the acceleration decides on slack. A gear
    of a shaft is loaded on the side of what it carries, which may be all rotor, as in a fall with
    the motor off; where that is not known, on the side of the motor.
    """
    out = flow
    motor = flow.motor_force
    probe = motor[0]
    if tendon.carried != real(0.0):
        probe = tendon.carried
    if least == real(0.0):
        probe = wp.max(motor[0], real(PULLING))
    gear = gear_line(probe, tendon, p)
    value = gear[0] + gear[1] * (motor[0] - probe)
    tension = Jet(value, gear[1] * motor[1], gear[1] * motor[2] + gear[2])
    gain = gear[1]
    if tendon.side * tendon.direction > real(1.5):
        tension = Jet(-real(HELD) * tendon.direction, real(0.0), real(0.0))
        gain = real(0.0)
    guide = guide_line(tension[0], tendon, p)
    slope = guide[1] * tension[1] + guide[2]
    out.tension = tension
    out.pull = Jet(guide[0], slope, guide[1] * tension[2])
    out.tension_gain = gain
    out.pull_gain = guide[1] * gain
    return out


@device_template
def flow_at(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    side: real,
) -> Flow:
    """Return what flows along tendon d on one side."""
    tendon = tendon_state(mechanism, world, p, drive, d, q, v, side)
    return tendon_flow(mechanism, world, p, d, tendon)


@device_template
def flow_memory(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    side: real,
    memory: MemoryVector,
) -> MemoryVector:
    """Renew what the effects along one tendon remember."""
    tendon = tendon_state(mechanism, world, p, drive, d, q, v, side)
    flow = tendon_flow(mechanism, world, p, d, tendon)
    memory = error_memory(flow.error, tendon, p, memory)
    memory = duty_memory(flow.duty, tendon, p, memory)
    memory = motor_force_memory(flow.motor_force, tendon, p, memory)
    return tension_memory(flow.tension, tendon, p, memory)


@device_template
def joint_state(
    mechanism: Mechanism, world: int, drive: Drive, j: int, q: JointVector, v: JointVector
) -> Joint:
    """Describe joint j to the effects."""
    joint = Joint()
    joint.index = j
    joint.elapsed = drive.elapsed
    joint.memory = drive.memory
    joint.position = q[j]
    joint.velocity = v[j]
    joint.stiffness = mechanism.stiffness[world][j]
    joint.rest = mechanism.rest[world][j]
    joint.damping = mechanism.damping[world][j]
    joint.lower = mechanism.lower[world][j]
    joint.upper = mechanism.upper[world][j]
    return joint


@device_template
def spring_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's return spring [N m]."""
    torque = Jet(-joint.stiffness * (joint.position - joint.rest), -joint.stiffness, real(0.0))
    return spring_effects(torque, joint, p)


@device_template
def damping_torque(joint: Joint, p: ParameterVector) -> Jet:
    """Return the torque of a joint's viscous damping [N m]."""
    torque = Jet(-joint.damping * joint.velocity, real(0.0), -joint.damping)
    return damping_effects(torque, joint, p)
