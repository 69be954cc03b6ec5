r"""The stages between a command and the tendon's pull, and between a joint's state and its torque.

    clock -> error -> duty -> [actuator] -> [servo's limit] -> motor force -> spool force -> tension
          -> [a string cannot push] -> transmission -> mechanism
    mechanism -> radius -> stretch -> angle -> error

Each name without brackets is a slot for effects (`tendon_newton.effects.base.Stage`); a kernel
holds only those that its model lists. An effect's function `tension` is called here as
`tension_effects`; `device_code.slots` has all slots. Forces travel as jets, so that the integrator
gets the derivatives it needs without finite differences.

A rotor of inertia J takes its part before the gear and the load cell see the motor's force:
the tension is :math:`F = f(F_m - a\,\ddot s)`, with :math:`a = J / r^2` and f what the gear's
friction leaves of a force. Friction is linear in the force of a string that pulls, so that two
numbers say how much of the rotor is felt: `Flow.tension_gain` at the load cell, `Flow.pull_gain` at
the mechanism. Where the spool has a coordinate of its own, `spools` takes these apart.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_DUTY,
    HAS_ROTOR,
    JOINTS,
    LINKS,
    ROUTED,
    ArmMatrix,
    Jet,
    JointVector,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import (
    actuator_force,
    angle_effects,
    asked_duty,
    damping_effects,
    driven_force,
    duty_effects,
    duty_memory,
    error_effects,
    error_memory,
    motor_force_effects,
    motor_force_memory,
    radius_effects,
    spool_force_effects,
    spool_force_memory,
    spring_effects,
    stretch_effects,
    tension_effects,
    tension_memory,
    transmission_effects,
)
from tendon_newton.device_code.structs import Drive, Flow, Joint, Mechanism, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow

HELD = 1.0e6
"""Force [N] that no mechanism overcomes: what a motor at its greatest speed holds against."""
UNDECIDED, TAUT, SLACK = 0.0, 1.0, 2.0
"""Whether a string pulls: what its force says, or what was decided at the start of a step."""


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
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, side: real
) -> Tendon:
    """Describe tendon d to the effects.

    Its side is +1 while it slides in and -1 while it slides out, +2 and -2 beyond the motor's
    speed; 0 leaves all friction out.
    """
    arms = tendon_arms(mechanism, here)
    bow = tendon_bow(here)
    tendon = Tendon()
    tendon.index = d
    tendon.asleep = here.asleep
    tendon.time = here.time
    tendon.elapsed = here.elapsed
    tendon.memory = here.memory
    tendon.voltage = here.voltage
    tendon.enabled = here.enabled
    tendon.slack = here.slack[d]
    tendon.carried = here.carried[d]
    tendon.force_limit = mechanism.force_limit[here.world][d]
    tendon.least_tension = mechanism.least_tension[here.world][d]
    tendon.command = here.command[d]
    tendon.nominal_radius = mechanism.spool_radius[here.world][d]
    tendon.spool_radius = radius_effects(tendon.nominal_radius, d, p)
    if wp.static(ROUTED):
        tendon.length = here.length[d]
    else:
        tendon.length = mechanism.excursion_offset[here.world][d] + excursion(arms, d, here.q)
    tendon.rate = excursion(arms, d, here.v)
    tendon.velocity = tendon.rate
    tendon.acceleration = excursion(arms, d, here.acceleration) + bow[d]
    tendon.wound = tendon.length
    if wp.static(FREE_SPOOL):
        tendon.wound = tendon.length + here.q[LINKS + d]
        tendon.velocity = tendon.velocity + here.v[LINKS + d]
        tendon.acceleration = tendon.acceleration + here.acceleration[LINKS + d]
    tendon.side = side
    tendon.direction = wp.clamp(side, real(-1.0), real(1.0))
    tendon.inverse_radius = real(1.0) / tendon.spool_radius
    tendon.angle_rate = Jet(tendon.velocity, real(0.0), real(1.0)) * tendon.inverse_radius
    return tendon


@device_template
def tendon_flow(tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the signal from the encoder through servo and tendon to the mechanism."""
    flow = servo_flow(tendon, p)
    acting = tendon
    acting.error = tendon.command - flow.angle[0]
    if wp.static(HAS_ROTOR):
        flow = rotor_flow(flow, acting, p)
    else:
        acting.motor_force = flow.motor_force
        flow.spool_force = spool_force_effects(flow.motor_force, acting, p)
        flow.tension = tension_effects(flow.spool_force, acting, p)
        flow.slack = tendon.slack
        if tendon.side * tendon.direction > real(1.5):
            flow.tension = Jet(-real(HELD) * tendon.direction, real(0.0), real(0.0))
            flow.slack = real(UNDECIDED)
        flow.line = flow.tension[0]
        if flow.slack == real(UNDECIDED):
            flow.slack = real(TAUT)
            if flow.tension[0] < tendon.least_tension:
                flow.slack = real(SLACK)
        if flow.slack == real(SLACK):
            flow.tension = Jet(tendon.least_tension, real(0.0), real(0.0))
        flow.pull = transmission_effects(flow.tension, acting, p)
    return flow


@device_template
def servo_flow(tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the signal from the encoder to the motor's force."""
    limit = tendon.force_limit
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
def after_gear(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what friction leaves of a motor's force [N]."""
    driven = tendon
    driven.motor_force = force
    return tension_effects(spool_force_effects(force, driven, p), driven, p)


@device_template
def gear_line(force: real, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what gear friction leaves of a force [N], its slope [1], its slope by v [N s/m]."""
    here = after_gear(Jet(force, real(0.0), real(0.0)), tendon, p)
    ahead = after_gear(Jet(force, real(1.0), real(0.0)), tendon, p)
    return Jet(here[0], ahead[1] - here[1], here[2])


@device_template
def passed_share(tension: Jet, pull: Jet, tendon: Tendon, p: ParameterVector) -> real:
    """Return by how much the pull at the mechanism grows with the tension behind it [1]."""
    ahead = transmission_effects(tension + Jet(real(0.0), real(1.0), real(0.0)), tendon, p)
    return ahead[1] - pull[1]


@device_template
def rotor_flow(flow: Flow, tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the motor's force through gear and guides, and how much of the rotor they pass on.

    A rotor that slows down keeps its string taut while the motor's force is negative. So slack is
    not decided here, but where the acceleration is known. A shaft's gear carries the motor's force
    less what accelerates the rotor (`tendon.carried`). In a fall with the motor off the rotor's
    part is all of it.
    """
    out = flow
    motor = flow.motor_force
    probe = motor[0]
    if tendon.carried != real(0.0):
        probe = tendon.carried
    gear = gear_line(probe, tendon, p)
    value = gear[0] + gear[1] * (motor[0] - probe)
    tension = Jet(value, gear[1] * motor[1], gear[1] * motor[2] + gear[2])
    gain = gear[1]
    if tendon.side * tendon.direction > real(1.5):
        tension = Jet(-real(HELD) * tendon.direction, real(0.0), real(0.0))
        gain = real(0.0)
    out.tension = tension
    out.pull = transmission_effects(tension, tendon, p)
    out.tension_gain = gain
    out.pull_gain = passed_share(tension, out.pull, tendon, p) * gain
    return out


@device_template
def flow_at(mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, side: real) -> Flow:
    """Return what flows along tendon d on one side."""
    tendon = tendon_state(mechanism, p, here, d, side)
    return tendon_flow(tendon, p)


@device_template
def flow_memory(
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, side: real, memory: MemoryVector
) -> MemoryVector:
    """Renew what the effects along one tendon remember."""
    tendon = tendon_state(mechanism, p, here, d, side)
    flow = tendon_flow(tendon, p)
    memory = error_memory(flow.error, tendon, p, memory)
    memory = duty_memory(flow.duty, tendon, p, memory)
    memory = motor_force_memory(flow.motor_force, tendon, p, memory)
    memory = spool_force_memory(flow.spool_force, tendon, p, memory)
    return tension_memory(flow.tension, tendon, p, memory)


@device_template
def joint_state(mechanism: Mechanism, here: Drive, j: int) -> Joint:
    """Describe joint j to the effects."""
    joint = Joint()
    joint.index = j
    joint.asleep = here.asleep
    joint.elapsed = here.elapsed
    joint.memory = here.memory
    joint.position = here.q[j]
    joint.velocity = here.v[j]
    joint.stiffness = mechanism.stiffness[here.world][j]
    joint.rest = mechanism.rest[here.world][j]
    joint.damping = mechanism.damping[here.world][j]
    joint.lower = mechanism.lower[here.world][j]
    joint.upper = mechanism.upper[here.world][j]
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
