"""The tendons and joints of a world as the law sees them."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
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
from tendon_newton.device_code.slots import radius_effects
from tendon_newton.device_code.structs import Drive, Flow, Joint, Mechanism, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import UNBOUNDED
from tendon_newton.law.string import renewed_memory, tendon_flow
from tendon_newton.simulation.tendons.routes import tendon_arms, tendon_bow


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
        if here.string[d] < real(UNBOUNDED) and here.q[LINKS + d] > real(0.0):
            tendon.string = here.string[d]
        tendon.velocity = tendon.velocity + here.v[LINKS + d]
        tendon.acceleration = tendon.acceleration + here.acceleration[LINKS + d]
    tendon.side = side
    tendon.direction = wp.clamp(side, real(-1.0), real(1.0))
    tendon.inverse_radius = real(1.0) / tendon.spool_radius
    tendon.angle_rate = Jet(tendon.velocity, real(0.0), real(1.0)) * tendon.inverse_radius
    return tendon


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
    return renewed_memory(tendon, p, memory)


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
