"""The kernel that takes worlds through the rows of a recording, one thread a world."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    CELL_MEMORY,
    HAS_SLOW_CELL,
    TENDONS,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import cell_effects
from tendon_newton.device_code.structs import (
    Cell,
    Commands,
    Mechanism,
    Readout,
    Rows,
    States,
    Worlds,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.integrator import step
from tendon_newton.simulation.dynamics.sensors import (
    INSTANT,
    cells_are_slow,
    first_due,
    read_sensors,
    report,
    tensions,
)
from tendon_newton.simulation.kernels.acting_command import (
    acting_command,
    acting_row,
    arrival,
    in_row,
    log_of,
    mean_command,
    substeps_in,
)
from tendon_newton.simulation.tendons.routes import located, placed
from tendon_newton.simulation.tendons.world_drive import at_start, world_drive


@device_template
def rollout_kernel(
    first_world: int,
    mechanism: Mechanism,
    worlds: Worlds,
    commands: Commands,
    rows: Rows,
    time_step: real,
    states: States,
    readout: Readout,
) -> None:
    """Simulate each world's recording between two rows; the states are carried on.

    The rows are those of the world's recording.
    """
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    recording = worlds.recording[i]
    begin = rows.begin[recording]
    p = worlds.parameters[i]
    log = log_of(commands, recording, p)
    drive = world_drive(mechanism, worlds.mechanism[i], p)
    drive = placed(drive, states.q[i], states.v[i])
    drive.memory = states.memory[i]
    slow = wp.static(HAS_SLOW_CELL) and cells_are_slow(p)
    cell = Cell()
    if wp.static(HAS_SLOW_CELL):
        for d in range(TENDONS):
            cell.due[d] = first_due(commands, log, p, d, begin)
            cell.force[d] = drive.memory[wp.static(CELL_MEMORY) + d]
    acting = int(begin)
    out = rows.out[i]
    for row in range(begin, wp.min(rows.end[recording], log.count)):
        drive = in_row(drive, commands, log, row)
        now = drive.time
        acting = acting_row(commands, log, p, 0, now, acting)
        drive.command = acting_command(commands, log, p, now, acting)
        here = located(mechanism, drive, drive.q, drive.v)
        reading = read_sensors(mechanism, p, here)
        readout.joint_position[out + row] = drive.q
        readout.motor_position[out + row] = reading.angle
        readout.motor_velocity[out + row] = reading.angle_rate
        readout.current[out + row] = reading.current
        if not slow:
            felt = TendonVector()
            for d in range(TENDONS):
                felt[d] = cell_effects(reading.force[d], now, d, p)
            readout.force[out + row] = felt
        interval = real(0.0)
        if row + 1 < log.count:
            interval = commands.time[log.first + row + 1] * log.scale - now
        if wp.static(HAS_SLOW_CELL):
            if row == 0:
                cell.force = reading.force
            if slow and row + 1 == log.count:
                cell.before = reading.force
                cell.after = reading.force
                last = real(2.0 * INSTANT)
                cell = report(commands, log, p, cell, now, last, out, readout.force)
        arrives = arrival(commands, log, p, now, interval, acting)
        before = substeps_in(arrives, time_step)
        steps = before + substeps_in(interval - arrives, time_step)
        tension = reading.force
        for k in range(steps):
            h = arrives / real(wp.max(before, 1))
            drive.time = now + real(k) * h
            if k >= before:
                h = (interval - arrives) / real(steps - before)
                drive.time = now + arrives + real(k - before) * h
            command = mean_command(commands, log, p, drive.time, h, acting)
            changed = bool(False)
            for d in range(TENDONS):
                changed = changed or command[d] != drive.command[d]
            drive.command = command
            motion = step(mechanism, p, drive, h)
            if wp.static(HAS_SLOW_CELL):
                if slow:
                    cell.before = tension
                    if changed:
                        here = located(mechanism, drive, drive.q, drive.v)
                        cell.before = tensions(mechanism, p, here)
                    after = at_start(drive, drive.time + h, motion.memory)
                    there = located(mechanism, after, motion.q, motion.v)
                    cell.after = tensions(mechanism, p, there)
                    tension = cell.after
                    cell = report(commands, log, p, cell, drive.time, h, out, readout.force)
            drive.q = motion.q
            drive.v = motion.v
            drive.memory = motion.memory
    if wp.static(HAS_SLOW_CELL):
        for d in range(TENDONS):
            drive.memory[wp.static(CELL_MEMORY) + d] = cell.force[d]
    states.q[i] = drive.q
    states.v[i] = drive.v
    states.memory[i] = drive.memory
