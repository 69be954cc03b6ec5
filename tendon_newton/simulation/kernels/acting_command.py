"""Which command acts when: a recording's commands, delayed by the servo's clock."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    TENDONS,
    MemoryVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import clock_effects, period_effects
from tendon_newton.device_code.structs import Commands, Drive, Log, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.sensors import INSTANT
from tendon_newton.simulation.tendons.world_drive import world_drive

EARLY = 1.0e-9
"""Time before a substep [s] within which a command counts as one that comes at its start.

The mean command has a kink where a command comes at the start of a substep. This margin always
gives the derivative for a command that comes later, however the two instants are rounded.
"""


@device_template
def log_of(commands: Commands, recording: int, p: ParameterVector) -> Log:
    """Return where a recording stands, and how its clock runs."""
    log = Log()
    log.first = commands.first[recording]
    log.count = commands.count[recording]
    log.scale = period_effects(real(1.0), p)
    return log


@device_template
def find_row(commands: Commands, log: Log, instant: real, guess: int) -> int:
    """Return the row whose command is in force at an instant [s]; the first row's before it."""
    first = log.first
    row = guess
    while row + 1 < log.count and commands.time[first + row + 1] <= instant:
        row = row + 1
    while row > 0 and commands.time[first + row] > instant:
        row = row - 1
    return row


@device_template
def acting_row(
    commands: Commands, log: Log, p: ParameterVector, d: int, time: real, guess: int
) -> int:
    """Return the row whose command servo d acts on just after an instant [s] of the simulation.

    A row's own instant belongs to it, however its product with the log's clock is rounded.
    """
    return find_row(commands, log, clock_effects(time, d, p) / log.scale + real(INSTANT), guess)


@device_template
def acting_command(
    commands: Commands, log: Log, p: ParameterVector, time: real, row: int
) -> TendonVector:
    """Return the commands [rad] that the servos act on just after an instant [s].

    The row is that of servo 0, from `acting_row`.
    """
    command = TendonVector()
    command[0] = commands.angle[log.first + row][0]
    for d in range(1, TENDONS):
        acting = acting_row(commands, log, p, d, time, row)
        command[d] = commands.angle[log.first + acting][d]
    return command


@device_template
def arrival(
    commands: Commands, log: Log, p: ParameterVector, time: real, interval: real, row: int
) -> real:
    """Return how long [s] after an instant the command behind a row's comes to servo 0.

    None comes before the interval [s] is over: its whole length.
    """
    arrives = interval
    if row + 1 < log.count:
        start = clock_effects(time, 0, p) / log.scale
        passing = clock_effects(time + interval, 0, p) / log.scale - start
        later = commands.time[log.first + row + 1] - start
        if later > real(INSTANT) and later < passing - real(INSTANT):
            arrives = interval * later / passing
    return arrives


@device_template
def substeps_in(interval: real, time_step: real) -> int:
    """Return how many substeps of at most a time step [s] an interval [s] has."""
    return int(wp.ceil(interval / time_step - real(1.0e-6)))


@device_template
def mean_command(
    commands: Commands, log: Log, p: ParameterVector, time: real, h: real, guess: int
) -> TendonVector:
    """Return the mean command [rad] over h [s] from an instant on, in which at most one comes."""
    command = TendonVector()
    for d in range(TENDONS):
        start = clock_effects(time, d, p) / log.scale
        end = clock_effects(time + h, d, p) / log.scale
        before = find_row(commands, log, start - real(EARLY), guess)
        after = find_row(commands, log, end, before)
        angle = commands.angle[log.first + after][d]
        if after > before:
            share = (commands.time[log.first + after] - start) / (end - start)
            angle = angle + share * (commands.angle[log.first + before][d] - angle)
        command[d] = angle
    return command


@device_template
def in_row(drive: Drive, commands: Commands, log: Log, row: int) -> Drive:
    """Return a drive at the instant of a row, with all that acts then but the command."""
    out = drive
    out.time = commands.time[log.first + row] * log.scale
    out.voltage = commands.voltage[log.first + row]
    out.enabled = commands.enabled[log.first + row]
    return out


@device_template
def just_after_row(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    commands: Commands,
    log: Log,
    row: int,
    memory: MemoryVector,
) -> Drive:
    """Return what acts on a world in a row, just after its command took effect."""
    drive = world_drive(mechanism, world, p)
    drive = in_row(drive, commands, log, row)
    acting = acting_row(commands, log, p, 0, drive.time, row)
    drive.command = acting_command(commands, log, p, drive.time, acting)
    drive.memory = memory
    return drive
