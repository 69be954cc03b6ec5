"""From the encoder to the mechanism, while a string moves with its spool."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    HAS_ROTOR,
    Jet,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import (
    duty_memory,
    error_memory,
    line_memory,
    motor_force_memory,
    spool_force_effects,
    spool_force_memory,
    tension_effects,
    tension_memory,
    transmission_effects,
)
from tendon_newton.device_code.structs import Flow, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.gear import rotor_flow
from tendon_newton.law.servo import holding_force, is_outrun, servo_flow

# Whether a string pulls: what its force says, or what was decided at the start of a step
UNDECIDED, TAUT, SLACK = 0.0, 1.0, 2.0


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
        if is_outrun(tendon):
            flow.tension = holding_force(tendon)
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
def renewed_memory(tendon: Tendon, p: ParameterVector, memory: MemoryVector) -> MemoryVector:
    """Renew what the effects along one tendon remember."""
    flow = tendon_flow(tendon, p)
    memory = error_memory(flow.error, tendon, p, memory)
    memory = duty_memory(flow.duty, tendon, p, memory)
    memory = motor_force_memory(flow.motor_force, tendon, p, memory)
    memory = spool_force_memory(flow.spool_force, tendon, p, memory)
    if wp.static(HAS_ROTOR):
        memory = line_memory(flow.tension, tendon, p, memory)
    return tension_memory(flow.tension, tendon, p, memory)
