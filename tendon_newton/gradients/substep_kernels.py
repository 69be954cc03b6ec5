"""Kernels of single substeps: forwards, their adjoints, and a sweep along slopes that are known.

Few substeps are divided at an event, but the code of an event is two thirds of a substep's, and all
threads of a GPU read it. The adjoint of a substep is two kernels: that of whole substeps, and
that of the few that `substep_kernel` has marked as divided.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    MEMORY_SIZE,
    DeviceArray,
    JointVector,
    MemoryVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import period_effects
from tendon_newton.device_code.structs import (
    Commands,
    DividedSubsteps,
    Drive,
    Marks,
    Mechanism,
    Schedule,
    Slopes,
    Span,
    StateRows,
    States,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.integrator import step, whole_step
from tendon_newton.simulation.kernels.acting_command import in_row, log_of, mean_command
from tendon_newton.simulation.tendons.routes import placed
from tendon_newton.simulation.tendons.world_drive import world_drive


@device_template
def with_command(drive: Drive, command: TendonVector, memory: MemoryVector) -> Drive:
    """Return a drive with its command [rad] and what its world remembers."""
    out = drive
    out.command = command
    out.memory = memory
    return out


@device_template
def substep_drive(
    mechanism: Mechanism,
    p: ParameterVector,
    commands: Commands,
    schedule: Schedule,
    at: int,
    world: int,
    memory: MemoryVector,
) -> Drive:
    """Return what acts on a world in a substep."""
    plan = schedule.plan[world]
    log = log_of(commands, world, p)
    row = schedule.row[at, plan]
    now = schedule.time[at, plan] * log.scale
    h = schedule.duration[at, plan] * log.scale
    drive = at_instant(in_row(world_drive(mechanism, world, p), commands, log, row), now)
    return with_command(drive, mean_command(commands, log, p, now, h, row), memory)


@device_template
def at_instant(drive: Drive, time: real) -> Drive:
    """Return a drive at an instant [s]."""
    out = drive
    out.time = time
    return out


@device_template
def substep_kernel(
    substep: int,
    at: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    marks: Marks,
    states: StateRows,
) -> None:
    """Take each world from row `at` of the states to the next; where it has arrived it waits.

    Keeps the contact states in which it began; marks and counts worlds that an event divided.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    q = states.q[at, i]
    v = states.v[at, i]
    kept = states.memory[at, i]
    duration = schedule.duration[substep, schedule.plan[i]]
    if duration > real(0.0):
        p = parameters[i]
        h = duration * period_effects(real(1.0), p)
        drive = substep_drive(mechanism, p, commands, schedule, substep, i, kept)
        motion = step(mechanism, p, placed(drive, q, v), h)
        marks.divided[at, i] = int(motion.divided)
        if motion.divided > real(0.0):
            wp.atomic_add(marks.count, 0, 1)  # pyright: ignore[reportArgumentType]
        marks.contact[at, i] = motion.contact
        states.q[at + 1, i] = motion.q
        states.v[at + 1, i] = motion.v
        states.memory[at + 1, i] = motion.memory
    else:
        states.q[at + 1, i] = q
        states.v[at + 1, i] = v
        states.memory[at + 1, i] = kept


@device_template
def copy_kernel(of: int, to: int, states: StateRows, out: StateRows) -> None:
    """Copy row `of` of the states of W worlds to row `to` of others."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    out.q[to, i] = states.q[of, i]
    out.v[to, i] = states.v[of, i]
    out.memory[to, i] = states.memory[of, i]


@device_template
def list_kernel(marks: Marks, listed: DividedSubsteps) -> None:
    """Give each divided one of (K, W) substeps a slot of a list, and write which it is: k W + i.

    Its mark becomes its slot, counted from one.
    """
    k, i = wp.tid()  # pyright: ignore[reportGeneralTypeIssues, reportAssignmentType]
    if marks.divided[k, i] > 0:
        slot = wp.atomic_add(listed.count, 0, 1)  # pyright: ignore[reportArgumentType]
        listed.place[slot] = k * marks.divided.shape[1] + i
        marks.divided[k, i] = slot + 1


@device_template
def gather_kernel(later: int, listed: DividedSubsteps, states: StateRows, out: States) -> None:
    """Copy states, or their adjoints, of listed substeps: `later` rows after their beginnings."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if slot < listed.count[0]:
        worlds = states.q.shape[1]
        k = listed.place[slot] // worlds
        i = listed.place[slot] - k * worlds
        out.q[slot] = states.q[k + later, i]
        out.v[slot] = states.v[k + later, i]
        out.memory[slot] = states.memory[k + later, i]


@device_template
def scatter_kernel(first: int, listed: DividedSubsteps, slopes: StateRows, out: Slopes) -> None:
    """Copy slopes of listed substeps to their places among those of (K, W) from `first` on."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if slot < listed.count[0]:
        worlds = out.q.shape[2]
        k = listed.place[slot] // worlds
        i = listed.place[slot] - k * worlds
        k = k - first
        if k >= 0 and k < out.q.shape[1]:
            for component in range(wp.static(2 * JOINTS + MEMORY_SIZE)):
                out.q[component, k, i] = slopes.q[component, slot]
                out.v[component, k, i] = slopes.v[component, slot]
                out.memory[component, k, i] = slopes.memory[component, slot]


@device_template
def whole_kernel(
    span: Span,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    marks: Marks,
    slopes: StateRows,
    states: StateRows,
    following: StateRows,
) -> None:
    """Take (K, W) states through substeps that no event divides; only its adjoint is used.

    If it `follows` slopes, a divided substep is what its slopes make of the state; else nothing.
    """
    k, i = wp.tid()  # pyright: ignore[reportGeneralTypeIssues, reportAssignmentType]
    q = states.q[span.before + k, i]
    v = states.v[span.before + k, i]
    kept = states.memory[span.before + k, i]
    out = span.after + k
    slot = marks.divided[span.at + k, i] - 1
    duration = schedule.duration[span.substep + k, schedule.plan[i]]
    if slot >= 0:
        if span.follows > 0:
            moved = JointVector()
            speed = JointVector()
            renewed = MemoryVector()
            for j in range(JOINTS):
                moved[j] = slope_sum(slopes, j, slot, q, v, kept)
                speed[j] = slope_sum(slopes, JOINTS + j, slot, q, v, kept)
            for s in range(wp.static(MEMORY_SIZE)):
                # a name of its own: a long loop stays one, and would change what is read above
                own = 2 * JOINTS + s
                renewed[s] = slope_sum(slopes, own, slot, q, v, kept)
            following.q[out, i] = moved
            following.v[out, i] = speed
            following.memory[out, i] = renewed
    elif duration > real(0.0):
        p = parameters[i]
        h = duration * period_effects(real(1.0), p)
        drive = substep_drive(mechanism, p, commands, schedule, span.substep + k, i, kept)
        motion = whole_step(mechanism, p, placed(drive, q, v), marks.contact[span.at + k, i], h)
        following.q[out, i] = motion.q
        following.v[out, i] = motion.v
        following.memory[out, i] = motion.memory
    else:
        following.q[out, i] = q
        following.v[out, i] = v
        following.memory[out, i] = kept


@device_template
def slope_sum(
    slopes: StateRows,
    component: int,
    slot: int,
    q: JointVector,
    v: JointVector,
    memory: MemoryVector,
) -> real:
    """Return what one component of the next state owes to a state, to first order."""
    total = wp.dot(slopes.q[component, slot], q) + wp.dot(slopes.v[component, slot], v)
    for s in range(wp.static(MEMORY_SIZE)):
        total = total + slopes.memory[component, slot][s] * memory[s]
    return total


@device_template
def divided_kernel(
    substep: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    listed: DividedSubsteps,
    states: States,
    following: States,
) -> None:
    """Take states through the listed substeps, counted from `substep`; only its adjoint is used."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if slot < listed.count[0]:
        worlds = parameters.shape[0]
        k = listed.place[slot] // worlds
        i = listed.place[slot] - k * worlds
        p = parameters[i]
        kept = states.memory[slot]
        drive = substep_drive(mechanism, p, commands, schedule, substep + k, i, kept)
        here = placed(drive, states.q[slot], states.v[slot])
        duration = schedule.duration[substep + k, schedule.plan[i]]
        motion = step(mechanism, p, here, duration * period_effects(real(1.0), p))
        following.q[slot] = motion.q
        following.v[slot] = motion.v
        following.memory[slot] = motion.memory


@device_template
def sweep_kernel(substep: int, count: int, slopes: Slopes, adjoint: StateRows) -> None:
    """Take the adjoint of each world's state back over substeps whose slopes are known.

    Slopes hold, per component of the state after a substep, its derivatives by the state before:
    shape (2 J + S, K, W). Each adjoint adds to what the readings left in its row.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    last = substep + count
    by_q = adjoint.q[last, i]
    by_v = adjoint.v[last, i]
    by_memory = adjoint.memory[last, i]
    for back in range(count):
        k = count - 1 - back
        q = adjoint.q[substep + k, i]
        v = adjoint.v[substep + k, i]
        memory = adjoint.memory[substep + k, i]
        for j in range(JOINTS):
            q = q + by_q[j] * slopes.q[j, k, i]
            v = v + by_q[j] * slopes.v[j, k, i]
            memory = memory + by_q[j] * slopes.memory[j, k, i]
        for j in range(JOINTS):
            q = q + by_v[j] * slopes.q[JOINTS + j, k, i]
            v = v + by_v[j] * slopes.v[JOINTS + j, k, i]
            memory = memory + by_v[j] * slopes.memory[JOINTS + j, k, i]
        for s in range(wp.static(MEMORY_SIZE)):
            q = q + by_memory[s] * slopes.q[2 * JOINTS + s, k, i]
            v = v + by_memory[s] * slopes.v[2 * JOINTS + s, k, i]
            memory = memory + by_memory[s] * slopes.memory[2 * JOINTS + s, k, i]
        adjoint.q[substep + k, i] = q
        adjoint.v[substep + k, i] = v
        adjoint.memory[substep + k, i] = memory
        by_q = q
        by_v = v
        by_memory = memory
