"""Kernels of single substeps: forwards, their adjoints, and a sweep along slopes that are known.

Few substeps are divided at an event, but the code of an event is two thirds of a substep's, and all
threads of a GPU read it. So the adjoint of a substep is two kernels: that of whole substeps, and
that of the few that `substep_kernel` has marked as divided.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    DeviceArray,
    DeviceBlock,
    DeviceGrid,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.integrator import step, whole_step
from tendon_newton.simulation.kernels.rollout_kernels import find_row
from tendon_newton.simulation.tendons.world_drive import world_drive

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Motion = Placeholder
Schedule = Placeholder
clock_effects: Any = None
period_effects: Any = None
REMEMBERED = 0
"""Numbers of the memory S."""

INSTANT = 1.0e-9
"""Two instants closer than this [s] are one."""


@device_template
def command_between(
    commands: Commands, first: int, count: int, row: int, start: real, end: real
) -> TendonVector:
    """Return `command_mean`.

    With the derivative for later edges where an edge and the substep's start are one instant.
    """
    before = find_row(commands, first, count, start - real(INSTANT), row)
    after = find_row(commands, first, count, end, before)
    command = commands.angle[first + after]
    if after > before:
        edge = commands.time[first + after]
        share = (edge - start) / (end - start)
        command = command + share * (commands.angle[first + before] - command)
    return command


@device_template
def row_drive(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    commands: Commands,
    at: int,
    time: real,
    memory: MemoryVector,
) -> Drive:
    """Return what acts on a world in a row, but for the command."""
    drive = world_drive(mechanism, world, p)
    drive.voltage = commands.voltage[at]
    drive.enabled = commands.enabled[at]
    drive.time = time
    drive.memory = memory
    return drive


@device_template
def with_command(drive: Drive, command: TendonVector, elapsed: real) -> Drive:
    """Return a drive with its command [rad] and the time [s] since its memory was current."""
    out = drive
    out.command = command
    out.elapsed = elapsed
    return out


@device_template
def substep_drive(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    commands: Commands,
    schedule: Schedule,
    at: int,
    memory: MemoryVector,
) -> Drive:
    """Return what acts on a world in a substep."""
    plan = schedule.plan[world]
    scale = period_effects(real(1.0), p)
    now = schedule.time[at, plan] * scale
    end = now + schedule.duration[at, plan] * scale
    first = commands.first[world]
    row = schedule.row[at, plan]
    mean = command_between(
        commands,
        first,
        commands.count[world],
        row,
        clock_effects(now, p) / scale,
        clock_effects(end, p) / scale,
    )
    drive = row_drive(mechanism, world, p, commands, first + row, now, memory)
    return with_command(drive, mean, real(0.0))


@device_template
def substep_kernel(
    substep: int,
    at: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    divided: DeviceGrid[int],
    modes: DeviceGrid[Modes],
    count: DeviceArray[int],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
) -> None:
    """Take each world from row `at` of the states to the next; where it has arrived it waits.

    Keeps the modes in which it began; marks, and counts, the worlds in which an event divided it.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    x = q[at, i]
    xd = v[at, i]
    kept = memory[at, i]
    duration = schedule.duration[substep, schedule.plan[i]]
    if duration > real(0.0):
        p = parameters[i]
        drive = substep_drive(mechanism, i, p, commands, schedule, substep, kept)
        motion = step(mechanism, i, p, drive, x, xd, duration * period_effects(real(1.0), p))
        divided[at, i] = int(motion.divided)
        if motion.divided > real(0.0):
            wp.atomic_add(count, 0, 1)  # pyright: ignore[reportArgumentType] - an array
        modes[at, i] = motion.modes
        q[at + 1, i] = motion.q
        v[at + 1, i] = motion.v
        memory[at + 1, i] = motion.memory
    else:
        q[at + 1, i] = x
        v[at + 1, i] = xd
        memory[at + 1, i] = kept


@device_template
def copy_kernel(
    of: int,
    to: int,
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
    out_q: DeviceGrid[JointVector],
    out_v: DeviceGrid[JointVector],
    out_memory: DeviceGrid[MemoryVector],
) -> None:
    """Copy row `of` of the states of W worlds to row `to` of others."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    out_q[to, i] = q[of, i]
    out_v[to, i] = v[of, i]
    out_memory[to, i] = memory[of, i]


@device_template
def list_kernel(
    divided: DeviceGrid[int], count: DeviceArray[int], places: DeviceArray[int]
) -> None:
    """Give each divided one of (K, W) substeps a slot of a list, and write which it is: k W + i.

    Its mark becomes its slot, counted from one.
    """
    k, i = wp.tid()  # pyright: ignore[reportGeneralTypeIssues, reportAssignmentType]
    if divided[k, i] > 0:
        slot = wp.atomic_add(count, 0, 1)  # pyright: ignore[reportArgumentType] - an array
        places[slot] = k * divided.shape[1] + i
        divided[k, i] = slot + 1


@device_template
def gather_kernel(
    later: int,
    count: DeviceArray[int],
    places: DeviceArray[int],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
    out_q: DeviceArray[JointVector],
    out_v: DeviceArray[JointVector],
    out_memory: DeviceArray[MemoryVector],
) -> None:
    """Copy states, or their adjoints, of listed substeps: `later` rows after their beginnings."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if slot < count[0]:
        worlds = q.shape[1]
        k = places[slot] // worlds
        i = places[slot] - k * worlds
        out_q[slot] = q[k + later, i]
        out_v[slot] = v[k + later, i]
        out_memory[slot] = memory[k + later, i]


@device_template
def scatter_kernel(
    first: int,
    count: DeviceArray[int],
    places: DeviceArray[int],
    slope_q: DeviceGrid[JointVector],
    slope_v: DeviceGrid[JointVector],
    slope_memory: DeviceGrid[MemoryVector],
    out_q: DeviceBlock[JointVector],
    out_v: DeviceBlock[JointVector],
    out_memory: DeviceBlock[MemoryVector],
) -> None:
    """Copy slopes of listed substeps to their places among those of (K, W) from `first` on."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if slot < count[0]:
        worlds = out_q.shape[2]
        k = places[slot] // worlds
        i = places[slot] - k * worlds
        k = k - first
        if k >= 0 and k < out_q.shape[1]:
            for component in range(wp.static(2 * JOINTS + REMEMBERED)):
                out_q[component, k, i] = slope_q[component, slot]
                out_v[component, k, i] = slope_v[component, slot]
                out_memory[component, k, i] = slope_memory[component, slot]


@device_template
def whole_kernel(
    substep: int,
    at: int,
    before: int,
    after: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    divided: DeviceGrid[int],
    modes: DeviceGrid[Modes],
    follows: int,
    slope_q: DeviceGrid[JointVector],
    slope_v: DeviceGrid[JointVector],
    slope_memory: DeviceGrid[MemoryVector],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
    next_q: DeviceGrid[JointVector],
    next_v: DeviceGrid[JointVector],
    next_memory: DeviceGrid[MemoryVector],
) -> None:
    """Take (K, W) states through substeps that no event divides; only its adjoint is used.

    From row `before + k` of the states to row `after + k` of the next ones. If it `follows` slopes,
    a divided substep is what its slopes make of the state; else it is nothing.
    """
    k, i = wp.tid()  # pyright: ignore[reportGeneralTypeIssues, reportAssignmentType]
    x = q[before + k, i]
    xd = v[before + k, i]
    kept = memory[before + k, i]
    out = after + k
    slot = divided[at + k, i] - 1
    duration = schedule.duration[substep + k, schedule.plan[i]]
    if slot >= 0:
        if follows > 0:
            moved = JointVector()
            speed = JointVector()
            renewed = MemoryVector()
            for j in range(JOINTS):
                moved[j] = slope_sum(slope_q, slope_v, slope_memory, j, slot, x, xd, kept)
                speed[j] = slope_sum(slope_q, slope_v, slope_memory, JOINTS + j, slot, x, xd, kept)
            for s in range(wp.static(REMEMBERED)):
                # a name of its own: a long loop stays one, and would change what is read above
                own = 2 * JOINTS + s
                renewed[s] = slope_sum(slope_q, slope_v, slope_memory, own, slot, x, xd, kept)
            next_q[out, i] = moved
            next_v[out, i] = speed
            next_memory[out, i] = renewed
    elif duration > real(0.0):
        p = parameters[i]
        drive = substep_drive(mechanism, i, p, commands, schedule, substep + k, kept)
        h = duration * period_effects(real(1.0), p)
        motion = whole_step(mechanism, i, p, drive, modes[at + k, i], x, xd, h)
        next_q[out, i] = motion.q
        next_v[out, i] = motion.v
        next_memory[out, i] = motion.memory
    else:
        next_q[out, i] = x
        next_v[out, i] = xd
        next_memory[out, i] = kept


@device_template
def slope_sum(
    slope_q: DeviceGrid[JointVector],
    slope_v: DeviceGrid[JointVector],
    slope_memory: DeviceGrid[MemoryVector],
    component: int,
    slot: int,
    q: JointVector,
    v: JointVector,
    memory: MemoryVector,
) -> real:
    """Return what one component of the next state owes to a state, to first order."""
    total = wp.dot(slope_q[component, slot], q) + wp.dot(slope_v[component, slot], v)
    for s in range(wp.static(REMEMBERED)):
        total = total + slope_memory[component, slot][s] * memory[s]
    return total


@device_template
def divided_kernel(
    substep: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    schedule: Schedule,
    count: DeviceArray[int],
    places: DeviceArray[int],
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    memory: DeviceArray[MemoryVector],
    next_q: DeviceArray[JointVector],
    next_v: DeviceArray[JointVector],
    next_memory: DeviceArray[MemoryVector],
) -> None:
    """Take states through the listed substeps, counted from `substep`; only its adjoint is used."""
    slot = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if slot < count[0]:
        worlds = parameters.shape[0]
        k = places[slot] // worlds
        i = places[slot] - k * worlds
        p = parameters[i]
        drive = substep_drive(mechanism, i, p, commands, schedule, substep + k, memory[slot])
        h = schedule.duration[substep + k, schedule.plan[i]] * period_effects(real(1.0), p)
        motion = step(mechanism, i, p, drive, q[slot], v[slot], h)
        next_q[slot] = motion.q
        next_v[slot] = motion.v
        next_memory[slot] = motion.memory


@device_template
def sweep_kernel(
    substep: int,
    count: int,
    slope_q: DeviceBlock[JointVector],
    slope_v: DeviceBlock[JointVector],
    slope_memory: DeviceBlock[MemoryVector],
    adjoint_q: DeviceGrid[JointVector],
    adjoint_v: DeviceGrid[JointVector],
    adjoint_memory: DeviceGrid[MemoryVector],
) -> None:
    """Take the adjoint of each world's state back over substeps whose slopes are known.

    Slopes hold, per component of the state after a substep, its derivatives by the state before:
    shape (2 J + S, K, W). Each adjoint adds to what the readings left in its row.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    last = substep + count
    by_q = adjoint_q[last, i]
    by_v = adjoint_v[last, i]
    by_memory = adjoint_memory[last, i]
    for back in range(count):
        k = count - 1 - back
        q = adjoint_q[substep + k, i]
        v = adjoint_v[substep + k, i]
        memory = adjoint_memory[substep + k, i]
        for j in range(JOINTS):
            q = q + by_q[j] * slope_q[j, k, i]
            v = v + by_q[j] * slope_v[j, k, i]
            memory = memory + by_q[j] * slope_memory[j, k, i]
        for j in range(JOINTS):
            q = q + by_v[j] * slope_q[JOINTS + j, k, i]
            v = v + by_v[j] * slope_v[JOINTS + j, k, i]
            memory = memory + by_v[j] * slope_memory[JOINTS + j, k, i]
        for s in range(wp.static(REMEMBERED)):
            q = q + by_memory[s] * slope_q[2 * JOINTS + s, k, i]
            v = v + by_memory[s] * slope_v[2 * JOINTS + s, k, i]
            memory = memory + by_memory[s] * slope_memory[2 * JOINTS + s, k, i]
        adjoint_q[substep + k, i] = q
        adjoint_v[substep + k, i] = v
        adjoint_memory[substep + k, i] = memory
        by_q = q
        by_v = v
        by_memory = memory
