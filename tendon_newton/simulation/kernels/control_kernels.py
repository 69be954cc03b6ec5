"""Kernels of one control step of many worlds.

Push the command, integrate all substeps, read the sensors.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    TENDONS,
    DeviceArray,
    DeviceGrid,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.integrator import step
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.modes import choose_modes
from tendon_newton.simulation.dynamics.sensors import read_sensors
from tendon_newton.simulation.dynamics.settling import SETTLED
from tendon_newton.simulation.kernels.history_kernels import all_present, push_samples, with_held
from tendon_newton.simulation.kernels.rollout_kernels import command_mean, find_row
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.world_drive import world_drive

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Servo = Placeholder
cell_effects: Any = None
clock_effects: Any = None
MEMORY_SIZE = 1
"""Numbers in a world's memory."""

FARTHEST = 1.0e5
"""A joint's position [rad, m] or speed beyond this is no mechanism's."""


@device_template
def resume(
    own: JointVector, given: DeviceArray[wp.float32], index: DeviceGrid[int], i: int
) -> JointVector:
    """Return a world's joint numbers.

    Where Newton's float32 is our own number rounded, go on with all its digits. A spool that moves
    on its own is none of Newton's joints, and has no place there.
    """
    out = own
    for j in range(LINKS):
        x = given[index[i, j]]
        if wp.float32(own[j]) != x:
            out[j] = real(x)
    return out


@device_template
def given_numbers(given: DeviceArray[wp.float32], index: DeviceGrid[int], i: int) -> JointVector:
    """Return a world's joint numbers as Newton has them; no spool leads its mechanism."""
    out = JointVector()
    for j in range(LINKS):
        out[j] = real(given[index[i, j]])
    return out


@device_template
def tendon_command(command: DeviceGrid[wp.float32], i: int) -> TendonVector:
    """Return the motor angles [rad] that a world is asked for."""
    out = TendonVector()
    for d in range(TENDONS):
        out[d] = real(command[i, d])
    return out


@device_template
def servo_drive(mechanism: Mechanism, p: ParameterVector, servo: Servo, i: int) -> Drive:
    """Return a world's instant, memory, supply and torque switch."""
    drive = world_drive(mechanism, i, p)
    drive.time = servo.time[i]
    drive.memory = servo.memory[i]
    drive.voltage = real(servo.voltage[i])
    drive.enabled = real(servo.enabled[i])
    return drive


@device_template
def forget_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    servo: Servo,
    history: Commands,
    history_length: int,
    command: DeviceGrid[wp.float32],
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    chosen: DeviceArray[wp.bool],
    q_in: DeviceArray[wp.float32],
    v_in: DeviceArray[wp.float32],
) -> None:
    """Begin anew in the chosen worlds.

    As if the present command had always been there and all memory were relaxed.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if chosen[i]:
        first = i * history_length
        for k in range(history_length):
            history.time[first + k] = real(k - history_length)
            history.angle[first + k] = tendon_command(command, i)
        servo.time[i] = real(0.0)
        drive = servo_drive(mechanism, parameters[i], servo, i)
        drive.command = tendon_command(command, i)
        drive.elapsed = real(SETTLED)
        drive.memory = MemoryVector()
        q = given_numbers(q_in, position_index, i)
        v = given_numbers(v_in, velocity_index, i)
        here = located(mechanism, i, drive, q, v)
        modes = choose_modes(mechanism, i, parameters[i], here, q, v)
        servo.q[i] = q
        servo.v[i] = v
        servo.memory[i] = remembered(mechanism, i, parameters[i], drive, modes, q, v)


@device_template
def control_step_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    servo: Servo,
    history: Commands,
    history_length: int,
    command: DeviceGrid[wp.float32],
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    substeps: int,
    h: real,
    q_in: DeviceArray[wp.float32],
    v_in: DeviceArray[wp.float32],
    q_out: DeviceArray[wp.float32],
    v_out: DeviceArray[wp.float32],
) -> None:
    """Hold a command for some substeps of h [s]."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    first = i * history_length
    for k in range(history_length - 1):
        history.time[first + k] = history.time[first + k + 1]
        history.angle[first + k] = history.angle[first + k + 1]
    newest = history_length - 1
    p = parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    start = drive.time
    history.time[first + newest] = start
    history.angle[first + newest] = tendon_command(command, i)
    q = resume(servo.q[i], q_in, position_index, i)
    v = resume(servo.v[i], v_in, velocity_index, i)
    for k in range(substeps):
        drive.time = start + real(k) * h
        drive.command = command_mean(
            history,
            first,
            history_length,
            newest,
            clock_effects(drive.time, p),
            clock_effects(drive.time + h, p),
        )
        motion = step(mechanism, i, p, drive, q, v, h)
        q = motion.q
        v = motion.v
        drive.memory = motion.memory
    servo.memory[i] = drive.memory
    servo.time[i] = start + real(substeps) * h
    servo.q[i] = q
    servo.v[i] = v
    for j in range(LINKS):
        q_out[position_index[i, j]] = wp.float32(q[j])
        v_out[velocity_index[i, j]] = wp.float32(v[j])


@device_template
def adopt_kernel(
    servo: Servo,
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    chosen: DeviceArray[wp.bool],
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    memory: DeviceArray[MemoryVector],
    q_out: DeviceArray[wp.float32],
    v_out: DeviceArray[wp.float32],
) -> None:
    """Take over a state in the chosen worlds."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if chosen[i]:
        servo.q[i] = q[i]
        servo.v[i] = v[i]
        servo.memory[i] = memory[i]
        for j in range(LINKS):
            q_out[position_index[i, j]] = wp.float32(q[i][j])
            v_out[velocity_index[i, j]] = wp.float32(v[i][j])


@device_template
def acting_command(
    p: ParameterVector,
    history: Commands,
    history_length: int,
    command: DeviceGrid[wp.float32],
    time: real,
    i: int,
) -> TendonVector:
    """Return the angles [rad] that the servos act on just after the present command was given."""
    instant = clock_effects(time, p)
    first = i * history_length
    acting = find_row(history, first, history_length, instant, history_length - 1)
    out = history.angle[first + acting]
    if instant >= time:
        out = tendon_command(command, i)
    return out


@device_template
def sense_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    servo: Servo,
    history: Commands,
    history_length: int,
    command: DeviceGrid[wp.float32],
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    chosen: DeviceArray[wp.bool],
    fill: int,
    q_in: DeviceArray[wp.float32],
    v_in: DeviceArray[wp.float32],
    ring: wp.array3d[wp.float32],
    newest: DeviceArray[int],
) -> None:
    """Show force networks the chosen worlds just after the present command was given.

    From then on forces are reckoned from there.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if chosen[i]:
        p = parameters[i]
        drive = servo_drive(mechanism, p, servo, i)
        drive.command = acting_command(p, history, history_length, command, drive.time, i)
        q = resume(servo.q[i], q_in, position_index, i)
        v = resume(servo.v[i], v_in, velocity_index, i)
        reading = read_sensors(mechanism, i, p, drive, q, v)
        push_samples(mechanism, i, p, drive, q, v, reading, i * TENDONS, fill, ring, newest)
        servo.memory[i] = all_present(mechanism, i, p, drive, q, v)


@device_template
def hold_kernel(
    mechanism: Mechanism,
    servo: Servo,
    chosen: DeviceArray[wp.bool],
    force: DeviceGrid[wp.float32],
) -> None:
    """Hold forces [N] in the chosen worlds from now on; one that is no number stays none."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    if chosen[i]:
        memory = servo.memory[i]
        for d in range(TENDONS):
            memory = with_held(mechanism, i, d, real(force[i, d]), memory)
        servo.memory[i] = memory


@device_template
def guard_kernel(
    servo: Servo,
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    good_q: DeviceArray[JointVector],
    good_memory: DeviceArray[MemoryVector],
    q_out: DeviceArray[wp.float32],
    v_out: DeviceArray[wp.float32],
    diverged: DeviceArray[wp.bool],
) -> None:
    """Put a world that left every physical range where it last was, at rest, and mark it."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    q = servo.q[i]
    v = servo.v[i]
    memory = servo.memory[i]
    fine = bool(True)  # noqa: UP018 - a variable for Warp, not a constant
    for j in range(JOINTS):
        if not (wp.abs(q[j]) < real(FARTHEST) and wp.abs(v[j]) < real(FARTHEST)):
            fine = False
    for k in range(wp.static(MEMORY_SIZE)):
        if not wp.isfinite(memory[k]):
            fine = False
    if fine:
        good_q[i] = q
        good_memory[i] = memory
    else:
        diverged[i] = wp.bool(True)
        servo.q[i] = good_q[i]
        servo.v[i] = JointVector()
        servo.memory[i] = good_memory[i]
        for j in range(LINKS):
            q_out[position_index[i, j]] = wp.float32(good_q[i][j])
            v_out[velocity_index[i, j]] = wp.float32(0.0)


@device_template
def read_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    servo: Servo,
    history: Commands,
    history_length: int,
    command: DeviceGrid[wp.float32],
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    q_in: DeviceArray[wp.float32],
    v_in: DeviceArray[wp.float32],
    angle: DeviceGrid[wp.float32],
    angle_rate: DeviceGrid[wp.float32],
    force: DeviceGrid[wp.float32],
) -> None:
    """Read encoder and load cell just after the present command was given."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    p = parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    drive.command = acting_command(p, history, history_length, command, drive.time, i)
    q = resume(servo.q[i], q_in, position_index, i)
    v = resume(servo.v[i], v_in, velocity_index, i)
    reading = read_sensors(mechanism, i, p, drive, q, v)
    for d in range(TENDONS):
        angle[i, d] = wp.float32(reading.angle[d])
        angle_rate[i, d] = wp.float32(reading.angle_rate[d])
        force[i, d] = wp.float32(cell_effects(reading.force[d], drive.time, p))
