"""The internal states of effects, renewed after every part of a step."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_MEMORY,
    JOINTS,
    LINKS,
    TENDONS,
    TOUCHES,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import contact_memory, spring_memory
from tendon_newton.device_code.structs import ContactStates, Drive, Mechanism, Motion
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.joint import spring_torque
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.states import flow_memory, joint_state
from tendon_newton.simulation.tendons.tension import held_share
from tendon_newton.simulation.tendons.world_drive import at_end

SHORTEST = 1.0e-12  # A part of a divided step [s] too short for a difference quotient


@device_template
def remembered(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates
) -> MemoryVector:
    """Return what the effects remember at a state that was reached in `here.elapsed`."""
    memory = here.memory
    for j in range(JOINTS):
        joint = joint_state(mechanism, here, j)
        memory = spring_memory(spring_torque(joint, p), joint, p, memory)
    for d in range(TENDONS):
        slides = contact.row_held[d] == real(0.0)
        if wp.static(FREE_SPOOL):
            # behind a spool that moves on its own, nothing remembers what its gear passes on
            slides = slides or contact.joint_held[LINKS + d] == real(0.0)
        if slides:
            memory = flow_memory(mechanism, p, here, d, contact.row_side[d], memory)
        else:
            share = held_share(mechanism, p, here, contact, d)
            side = contact.least_side[d]
            least = flow_memory(mechanism, p, here, d, side, memory)
            side = contact.most_side[d]
            most = flow_memory(mechanism, p, here, d, side, memory)
            memory = least + (most - least) * share
    if wp.static(TOUCHES):
        if here.elapsed > real(0.0):
            memory = contact_memory(mechanism, here, memory)
    return memory


@device_template
def renewed(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    end: Motion,
    h: real,
) -> MemoryVector:
    """Return what the effects remember after a step of h [s]."""
    memory = here.memory
    if wp.static(HAS_MEMORY):
        if here.remembers > real(0.0):
            acceleration = (end.v - here.v) / wp.max(h, real(SHORTEST))
            later = at_end(here, h, acceleration)
            later = located(mechanism, later, end.q, end.v)
            memory = remembered(mechanism, p, later, contact)
    return memory


@device_template
def renewed_at(
    mechanism: Mechanism, p: ParameterVector, later: Drive, contact: ContactStates
) -> MemoryVector:
    """Return what the effects remember at the end of a step."""
    memory = later.memory
    if wp.static(HAS_MEMORY):
        if later.remembers > real(0.0):
            memory = remembered(mechanism, p, later, contact)
    return memory
