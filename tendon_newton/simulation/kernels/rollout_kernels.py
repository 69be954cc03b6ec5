"""The kernel that takes worlds through the rows of a recording, one thread a world."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    TENDONS,
    DeviceArray,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.integrator import step
from tendon_newton.simulation.dynamics.sensors import (
    INSTANT,
    cell_is_slow,
    first_due,
    read_sensors,
    report,
    tensions,
)
from tendon_newton.simulation.tendons.world_drive import at_start, world_drive

Cell = Placeholder
Commands = Placeholder
Mechanism = Placeholder
cell_effects: Any = None
clock_effects: Any = None
period_effects: Any = None
HAS_SLOW_CELL = False
"""Whether any effect of the kernel makes the load cell late or lag."""
CELL_MEMORY = 0
"""Where the lagging cells' readings stand in a world's memory."""


@device_template
def find_row(commands: Commands, first: int, count: int, instant: real, guess: int) -> int:
    """Return the row whose command is in force at an instant [s]; the first row's before it."""
    row = guess
    while row + 1 < count and commands.time[first + row + 1] <= instant:
        row = row + 1
    while row > 0 and commands.time[first + row] > instant:
        row = row - 1
    return row


@device_template
def acting_row(
    commands: Commands,
    first: int,
    count: int,
    time: real,
    scale: real,
    p: ParameterVector,
    guess: int,
) -> int:
    """Return the row whose command the servo acts on just after an instant [s] of the simulation.

    A row's own instant belongs to it, however its product with the log's clock is rounded.
    """
    instant = clock_effects(time, p) / scale + real(INSTANT)
    return find_row(commands, first, count, instant, guess)


@device_template
def command_mean(
    commands: Commands, first: int, count: int, row: int, start: real, end: real
) -> TendonVector:
    """Return the mean command [rad] between two instants [s] that at most one edge separates."""
    before = find_row(commands, first, count, start, row)
    after = find_row(commands, first, count, end, before)
    command = commands.angle[first + after]
    if after > before:
        edge = commands.time[first + after]
        share = (edge - start) / (end - start)
        command = command + share * (commands.angle[first + before] - command)
    return command


@device_template
def rollout_kernel(
    first_world: int,
    mechanism: Mechanism,
    world_mechanism: DeviceArray[int],
    world_recording: DeviceArray[int],
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    rows_from: DeviceArray[int],
    rows_to: DeviceArray[int],
    time_step: real,
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    memory: DeviceArray[MemoryVector],
    output_first: DeviceArray[int],
    joint_position: DeviceArray[JointVector],
    angle: DeviceArray[TendonVector],
    angle_rate: DeviceArray[TendonVector],
    force: DeviceArray[TendonVector],
) -> None:
    """Simulate each world's recording between two rows; q, v and memory carry the state on.

    The rows are those of the world's recording.
    """
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue] - one dimension: a number
    world = world_mechanism[i]
    recording = world_recording[i]
    first = commands.first[recording]
    count = commands.count[recording]
    begin = rows_from[recording]
    p = parameters[i]
    x = q[i]
    xd = v[i]
    scale = period_effects(real(1.0), p)
    drive = world_drive(mechanism, world, p)
    drive.memory = memory[i]
    slow = wp.static(HAS_SLOW_CELL) and cell_is_slow(p)
    cell = Cell()
    if wp.static(HAS_SLOW_CELL):
        cell.due = first_due(commands, first, count, begin, scale, p)
        for d in range(TENDONS):
            cell.force[d] = drive.memory[wp.static(CELL_MEMORY) + d]
    acting = int(begin)
    out = output_first[i]
    for row in range(begin, wp.min(rows_to[recording], count)):
        now = commands.time[first + row] * scale
        drive.time = now
        drive.voltage = commands.voltage[first + row]
        drive.enabled = commands.enabled[first + row]
        acting = acting_row(commands, first, count, now, scale, p, acting)
        drive.command = commands.angle[first + acting]
        reading = read_sensors(mechanism, world, p, drive, x, xd)
        joint_position[out + row] = x
        angle[out + row] = reading.angle
        angle_rate[out + row] = reading.angle_rate
        if not slow:
            for d in range(TENDONS):
                force[out + row][d] = cell_effects(reading.force[d], now, p)
        interval = real(0.0)
        if row + 1 < count:
            interval = commands.time[first + row + 1] * scale - now
        if wp.static(HAS_SLOW_CELL):
            if row == 0:
                cell.force = reading.force
            if slow and row + 1 == count:
                cell = report(
                    commands,
                    first,
                    count,
                    scale,
                    p,
                    cell,
                    now,
                    real(2.0 * INSTANT),
                    reading.force,
                    reading.force,
                    out,
                    force,
                )
        steps = int(wp.ceil(interval / time_step - real(1.0e-6)))
        h = interval / real(wp.max(steps, 1))
        for k in range(steps):
            drive.time = now + real(k) * h
            drive.command = command_mean(
                commands,
                first,
                count,
                acting,
                clock_effects(drive.time, p) / scale,
                clock_effects(drive.time + h, p) / scale,
            )
            motion = step(mechanism, world, p, drive, x, xd, h)
            if wp.static(HAS_SLOW_CELL):  # noqa: SIM102 - known when compiled
                if slow:
                    after = at_start(drive, drive.time + h, motion.memory)
                    cell = report(
                        commands,
                        first,
                        count,
                        scale,
                        p,
                        cell,
                        drive.time,
                        h,
                        tensions(mechanism, world, p, drive, x, xd),
                        tensions(mechanism, world, p, after, motion.q, motion.v),
                        out,
                        force,
                    )
            x = motion.q
            xd = motion.v
            drive.memory = motion.memory
    if wp.static(HAS_SLOW_CELL):
        for d in range(TENDONS):
            drive.memory[wp.static(CELL_MEMORY) + d] = cell.force[d]
    q[i] = x
    v[i] = xd
    memory[i] = drive.memory
