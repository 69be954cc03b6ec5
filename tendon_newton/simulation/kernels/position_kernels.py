"""Kernels of a servo of which only the position is known: no force and no mass.

    clock -> profile, [load], deadband -> [target] -> lag -> speed -> play -> offset

Each name without brackets is an effect, with the device function that acts in the force model too.
What the lag remembers is the position of the drive; beyond the play is the shaft. A state's q is
the shaft, its v the drive, both angles; its memory is that of the profile.
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    Jet,
    JointVector,
    MemoryVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import (
    error_effects,
    error_memory,
    motor_force_effects,
    offset_effects,
    play_effects,
    speed_effects,
)
from tendon_newton.device_code.structs import (
    Commands,
    Mechanism,
    Readout,
    Rows,
    States,
    Tendon,
    Worlds,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import SETTLED, UNBOUNDED
from tendon_newton.simulation.dynamics.settling import AS_MEASURED
from tendon_newton.simulation.kernels.acting_command import (
    acting_row,
    log_of,
    mean_command,
    substeps_in,
)

# Effects that can act where only positions are known
POSITION_EFFECTS = (
    "command_delay",
    "sample_period_error",
    "position_offset",
    "acceleration_limit",
    "backlash",
    "deadband",
    "actuator_lag",
    "speed_limit",
)
# Step [s]: nothing here is stiff, and the lag is exact for a command that stands still
POSITION_STEP = 2.5e-3


@device_template
def asked(command: real, elapsed: real, memory: MemoryVector) -> Tendon:
    """Return what acts on a drive some time [s] into a command [rad]."""
    tendon = Tendon()
    tendon.elapsed = elapsed
    tendon.memory = memory
    tendon.command = command
    return tendon


@device_template
def profiled(
    p: ParameterVector, command: real, elapsed: real, memory: MemoryVector
) -> MemoryVector:
    """Return what a profile remembers after some time [s] under a command [rad]."""
    nothing = Jet(real(0.0), real(0.0), real(0.0))
    tendon = asked(command, elapsed, memory)
    return error_memory(nothing, tendon, p, memory)


@device_template
def followed(
    p: ParameterVector,
    position: real,
    command: real,
    elapsed: real,
    memory: MemoryVector,
    load: real,
) -> real:
    """Return where a drive at a position is after some time [s] under a command [rad].

    The load [N m] takes it from its goal by the servo's compliance, the actuator's only number.
    """
    tendon = asked(command, elapsed, memory)
    error = Jet(command + p[0] * load - position, real(0.0), real(0.0))
    target = error_effects(error, tendon, p) + Jet(position, real(0.0), real(0.0))
    tendon.memory = MemoryVector(position)
    reached = motor_force_effects(target, tendon, p)
    way = reached[0] - position
    bound = speed_effects(real(UNBOUNDED), 0, p)
    if bound < real(UNBOUNDED):
        way = wp.clamp(way, -bound * elapsed, bound * elapsed)
    return position + way


@device_template
def carried(p: ParameterVector, shaft: real, drive: real) -> real:
    """Return where the shaft is once its drive has moved: the play between them may open."""
    tendon = Tendon()
    tendon.command = drive
    inside = play_effects(Jet(shaft, real(0.0), real(0.0)), tendon, p)
    return shaft + drive - inside[0]


@device_template
def reported(p: ParameterVector, shaft: real) -> real:
    """Return the angle that the encoder reports [rad]."""
    tendon = Tendon()
    angle = offset_effects(Jet(shaft, real(0.0), real(0.0)), tendon, p)
    return angle[0]


@device_template
def start_kernel(
    first_world: int, mechanism: Mechanism, worlds: Worlds, commands: Commands, states: States
) -> None:
    """Put each shaft at its first command, or where it was measured."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    recording = worlds.recording[i]
    shaft = commands.angle[commands.first[recording]][0]
    if commands.start[recording] == AS_MEASURED:
        shaft = commands.start_angle[recording][0] - reported(worlds.parameters[i], real(0.0))
    states.q[i] = JointVector(shaft)
    states.v[i] = JointVector(shaft)
    goal = commands.angle[commands.first[recording]][0]
    memory = MemoryVector(shaft)
    states.memory[i] = profiled(worlds.parameters[i], goal, real(SETTLED), memory)


@device_template
def position_kernel(
    first_world: int,
    mechanism: Mechanism,
    worlds: Worlds,
    commands: Commands,
    rows: Rows,
    time_step: real,
    states: States,
    readout: Readout,
) -> None:
    """Move each world's shaft through its recording."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    recording = worlds.recording[i]
    begin = rows.begin[recording]
    p = worlds.parameters[i]
    log = log_of(commands, recording, p)
    shaft = states.q[i][0]
    drive = states.v[i][0]
    memory = states.memory[i]
    acting = int(begin)
    out = rows.out[i]
    before = reported(p, shaft)
    passed = real(1.0)
    for row in range(begin, wp.min(rows.end[recording], log.count)):
        now = commands.time[log.first + row] * log.scale
        load = commands.load[log.first + row]
        enabled = commands.enabled[log.first + row] > real(0.0)
        acting = acting_row(commands, log, p, 0, now, acting)
        if enabled and row > 0:
            goal = commands.angle[log.first + acting][0]
            drive = followed(p, drive, goal, real(0.0), memory, load)
            shaft = carried(p, shaft, drive)
        reading = reported(p, shaft)
        readout.joint_position[out + row] = JointVector(shaft)
        readout.motor_position[out + row] = TendonVector(reading)
        readout.motor_velocity[out + row] = TendonVector((reading - before) / passed)
        before = reading
        if row + 1 < log.count:
            passed = commands.time[log.first + row + 1] * log.scale - now
            steps = wp.max(substeps_in(passed, time_step), 1)
            h = passed / real(steps)
            for k in range(steps):
                command = mean_command(commands, log, p, now + real(k) * h, h, acting)
                if enabled:
                    drive = followed(p, drive, command[0], h, memory, load)
                    memory = profiled(p, command[0], h, memory)
                    shaft = carried(p, shaft, drive)
    states.q[i] = JointVector(shaft)
    states.v[i] = JointVector(drive)
    states.memory[i] = memory
