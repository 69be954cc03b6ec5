"""Kernels of a servo of which only the position is known: no force, no mass, no load.

    clock -> error -> [target] -> lag -> speed -> play -> offset

Each name without brackets is the stage of one effect, with the device function that acts in the
force model too. What the lag remembers is the position of the drive; beyond the play is the shaft.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    DeviceArray,
    Jet,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.kernels.rollout_kernels import acting_row, command_mean
from tendon_newton.simulation.tendons.world_drive import UNBOUNDED

Commands = Placeholder
Mechanism = Placeholder
Tendon = Placeholder
clock_effects: Any = None
error_effects: Any = None
motor_force_effects: Any = None
offset_effects: Any = None
period_effects: Any = None
play_effects: Any = None
speed_effects: Any = None

POSITION_EFFECTS = (
    "command_delay",
    "sample_period_error",
    "position_offset",
    "backlash",
    "deadband",
    "actuator_lag",
    "speed_limit",
)
"""Effects that can act where only positions are known."""
POSITION_STEP = 2.5e-3
"""Step [s]: nothing here is stiff, and the lag is exact for a command that stands still."""


@device_template
def followed(p: ParameterVector, position: real, command: real, elapsed: real) -> real:
    """Return where a drive at a position is after some time [s] under a command [rad]."""
    tendon = Tendon()
    tendon.elapsed = elapsed
    tendon.memory = MemoryVector(position)
    tendon.command = command
    error = Jet(command - position, real(0.0), real(0.0))
    target = error_effects(error, tendon, p) + Jet(position, real(0.0), real(0.0))
    reached = motor_force_effects(target, tendon, p)
    way = reached[0] - position
    bound = speed_effects(real(UNBOUNDED), p)
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
    angle = offset_effects(Jet(shaft, real(0.0), real(0.0)), Tendon(), p)
    return angle[0]


@device_template
def start_kernel(
    first_world: int,
    mechanism: Mechanism,
    world_mechanism: DeviceArray[int],
    world_recording: DeviceArray[int],
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    memory: DeviceArray[MemoryVector],
) -> None:
    """Put each shaft at its first command, or where it was measured."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue] - one dimension: a number
    recording = world_recording[i]
    shaft = commands.angle[commands.first[recording]][0]
    if commands.starts_measured[recording] > 0:
        shaft = commands.start_angle[recording][0] - reported(parameters[i], real(0.0))
    q[i] = JointVector(shaft)
    memory[i] = MemoryVector(shaft)


@device_template
def position_kernel(
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
    """Move each world's shaft through its recording; the memory holds the drive's position."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue] - one dimension: a number
    recording = world_recording[i]
    first = commands.first[recording]
    count = commands.count[recording]
    begin = rows_from[recording]
    p = parameters[i]
    shaft = q[i][0]
    drive = memory[i][0]
    scale = period_effects(real(1.0), p)
    acting = int(begin)
    out = output_first[i]
    before = reported(p, shaft)
    passed = real(1.0)
    for row in range(begin, wp.min(rows_to[recording], count)):
        now = commands.time[first + row] * scale
        enabled = commands.enabled[first + row] > real(0.0)
        acting = acting_row(commands, first, count, now, scale, p, acting)
        if enabled and row > 0:
            drive = followed(p, drive, commands.angle[first + acting][0], real(0.0))
            shaft = carried(p, shaft, drive)
        reading = reported(p, shaft)
        joint_position[out + row] = JointVector(shaft)
        angle[out + row] = TendonVector(reading)
        angle_rate[out + row] = TendonVector((reading - before) / passed)
        before = reading
        if row + 1 < count:
            passed = commands.time[first + row + 1] * scale - now
            steps = int(wp.max(wp.ceil(passed / time_step - real(1.0e-6)), real(1.0)))
            h = passed / real(steps)
            for k in range(steps):
                start = now + real(k) * h
                command = command_mean(
                    commands,
                    first,
                    count,
                    acting,
                    clock_effects(start, p) / scale,
                    clock_effects(start + h, p) / scale,
                )
                if enabled:
                    drive = followed(p, drive, command[0], h)
                    shaft = carried(p, shaft, drive)
    q[i] = JointVector(shaft)
    memory[i] = MemoryVector(drive)
