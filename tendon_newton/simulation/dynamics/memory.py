"""The internal states of effects, renewed after every part of a step."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    TENDONS,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.tendons.pipeline import flow_memory, joint_state, spring_torque
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.tension import held_share
from tendon_newton.simulation.tendons.world_drive import at_end

Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Motion = Placeholder
contact_memory: Any = None
spring_memory: Any = None
HAS_MEMORY = False
"""Whether any effect of the kernel has internal state."""
TOUCHES = False
"""Whether links may meet obstacles."""
FREE_SPOOL = False
"""Whether each spool has a coordinate of its own."""
REMEMBERS_ROUTED = False
"""Whether one has while a tendon's moment arms follow from its path."""

SHORTEST = 1.0e-12
"""A part of a divided step [s] too short for a difference quotient."""


@device_template
def remembered(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
) -> MemoryVector:
    """Return what the effects remember at a state that was reached in `drive.elapsed`."""
    memory = drive.memory
    here = drive
    if wp.static(REMEMBERS_ROUTED):
        here = located(mechanism, world, drive, q, v)
    for j in range(JOINTS):
        joint = joint_state(mechanism, world, drive, j, q, v)
        memory = spring_memory(spring_torque(joint, p), joint, p, memory)
    for d in range(TENDONS):
        slides = modes.tendon_sticks[d] == real(0.0)
        if wp.static(FREE_SPOOL):
            # behind a spool that moves on its own, nothing remembers what its gear passes on
            slides = slides or modes.joint_sticks[LINKS + d] == real(0.0)
        if slides:
            memory = flow_memory(mechanism, world, p, here, d, q, v, modes.tendon[d], memory)
        else:
            share = held_share(mechanism, world, p, here, modes, d, q, v)
            side = modes.least_side[d]
            least = flow_memory(mechanism, world, p, here, d, q, v, side, memory)
            side = modes.most_side[d]
            most = flow_memory(mechanism, world, p, here, d, q, v, side, memory)
            memory = least + (most - least) * share
    if wp.static(TOUCHES):  # noqa: SIM102 - known when compiled
        if drive.elapsed > real(0.0):
            memory = contact_memory(mechanism, world, drive, q, v, memory)
    return memory


@device_template
def renewed(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    before: JointVector,
    end: Motion,
    h: real,
) -> MemoryVector:
    """Return what the effects remember after a step of h [s] that began at a velocity `before`."""
    memory = drive.memory
    if wp.static(HAS_MEMORY):  # noqa: SIM102 - known when compiled
        if drive.remembers > real(0.0):
            acceleration = (end.v - before) / wp.max(h, real(SHORTEST))
            later = at_end(drive, h, acceleration)
            memory = remembered(mechanism, world, p, later, modes, end.q, end.v)
    return memory
