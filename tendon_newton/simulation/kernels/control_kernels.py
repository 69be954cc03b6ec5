"""Kernels of one control step of many worlds.

Push the command, integrate all substeps, read the sensors.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    MEMORY_SIZE,
    SHARES_BODY,
    TENDONS,
    DeviceArray,
    DeviceGrid,
    JointVector,
    MemoryVector,
    ParameterVector,
    TendonVector,
    Vec3,
    real,
)
from tendon_newton.device_code.slots import cell_effects, clock_effects
from tendon_newton.device_code.structs import (
    Commands,
    Drive,
    Log,
    Mechanism,
    NewtonJoints,
    Samples,
    Servo,
    States,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import SETTLED
from tendon_newton.simulation.dynamics.contact_states import choose_contact_states
from tendon_newton.simulation.dynamics.integrator import step
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.sensors import read_sensors
from tendon_newton.simulation.kernels.acting_command import find_row, mean_command
from tendon_newton.simulation.kernels.history_kernels import all_present, push_samples, with_held
from tendon_newton.simulation.tendons.routes import located, placed
from tendon_newton.simulation.tendons.world_drive import world_drive

FARTHEST = 1.0e5  # A joint's position [rad, m] or speed beyond this is no mechanism's


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
def resumed(drive: Drive, servo: Servo, given: NewtonJoints, i: int) -> Drive:
    """Return a drive in the posture in which Newton has its world."""
    q = resume(servo.q[i], given.position, servo.position_index, i)
    v = resume(servo.v[i], given.velocity, servo.velocity_index, i)
    return placed(drive, q, v)


@device_template
def hand_over(
    servo: Servo, i: int, q: JointVector, v: JointVector, memory: MemoryVector, out: NewtonJoints
) -> None:
    """Keep a world's state, and tell Newton."""
    servo.q[i] = q
    servo.v[i] = v
    servo.memory[i] = memory
    for j in range(LINKS):
        out.position[servo.position_index[i, j]] = wp.float32(q[j])
        out.velocity[servo.velocity_index[i, j]] = wp.float32(v[j])


@device_template
def tendon_command(servo: Servo, i: int) -> TendonVector:
    """Return the motor angles [rad] that a world is asked for."""
    out = TendonVector()
    for d in range(TENDONS):
        out[d] = real(servo.command[i, d])
    return out


@device_template
def past_of(history: Commands, i: int) -> Log:
    """Return where the past commands of a world stand."""
    log = Log()
    log.first = history.first[i]
    log.count = history.count[i]
    log.scale = real(1.0)
    return log


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
def just_asked(
    mechanism: Mechanism, servo: Servo, history: Commands, given: NewtonJoints, i: int
) -> Drive:
    """Return what acts on a world, and where it is, just after the present command was given."""
    p = servo.parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    drive = resumed(drive, servo, given, i)
    log = past_of(history, i)
    command = tendon_command(servo, i)
    for d in range(TENDONS):
        instant = clock_effects(drive.time, d, p)
        if instant < drive.time:
            acting = find_row(history, log, instant, log.count - 1)
            command[d] = history.angle[log.first + acting][d]
    drive.command = command
    return located(mechanism, drive, drive.q, drive.v)


@device_template
def forget_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    chosen: DeviceArray[wp.bool],
    given: NewtonJoints,
) -> None:
    """Begin anew in the chosen worlds.

    As if the present command had always been there and all memory were relaxed.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if chosen[i]:
        log = past_of(history, i)
        for k in range(log.count):
            history.time[log.first + k] = real(k - log.count)
            history.angle[log.first + k] = tendon_command(servo, i)
        servo.time[i] = real(0.0)
        p = servo.parameters[i]
        drive = servo_drive(mechanism, p, servo, i)
        drive.command = tendon_command(servo, i)
        drive.elapsed = real(SETTLED)
        drive.memory = MemoryVector()
        q = given_numbers(given.position, servo.position_index, i)
        v = given_numbers(given.velocity, servo.velocity_index, i)
        here = located(mechanism, drive, q, v)
        contact = choose_contact_states(mechanism, p, here)
        servo.q[i] = q
        servo.v[i] = v
        if wp.static(SHARES_BODY):
            servo.body_push[i, 0] = Vec3()
            servo.body_push[i, 1] = Vec3()
        servo.memory[i] = remembered(mechanism, p, here, contact)


@device_template
def control_step_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    substeps: int,
    h: real,
    given: NewtonJoints,
    out: NewtonJoints,
) -> None:
    """Hold a command for some substeps of h [s]."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    log = past_of(history, i)
    newest = log.count - 1
    for k in range(newest):
        history.time[log.first + k] = history.time[log.first + k + 1]
        history.angle[log.first + k] = history.angle[log.first + k + 1]
    p = servo.parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    drive = resumed(drive, servo, given, i)
    start = drive.time
    history.time[log.first + newest] = start
    history.angle[log.first + newest] = tendon_command(servo, i)
    for k in range(substeps):
        drive.time = start + real(k) * h
        drive.command = mean_command(history, log, p, drive.time, h, newest)
        motion = step(mechanism, p, drive, h)
        drive.q = motion.q
        drive.v = motion.v
        drive.memory = motion.memory
    servo.time[i] = start + real(substeps) * h
    hand_over(servo, i, drive.q, drive.v, drive.memory, out)


@device_template
def adopt_kernel(servo: Servo, chosen: DeviceArray[int], states: States, out: NewtonJoints) -> None:
    """Take over states, one for each world that is named."""
    k = int(wp.tid())  # pyright: ignore[reportArgumentType]
    hand_over(servo, chosen[k], states.q[k], states.v[k], states.memory[k], out)


@device_template
def sense_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    chosen: DeviceArray[wp.bool],
    fill: int,
    given: NewtonJoints,
    samples: Samples,
) -> None:
    """Show force networks the chosen worlds just after the present command was given.

    From then on forces are reckoned from there.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if chosen[i]:
        p = servo.parameters[i]
        here = just_asked(mechanism, servo, history, given, i)
        reading = read_sensors(mechanism, p, here)
        push_samples(mechanism, p, here, reading, i * TENDONS, fill, samples)
        servo.memory[i] = all_present(mechanism, p, here)


@device_template
def hold_kernel(
    mechanism: Mechanism, servo: Servo, chosen: DeviceArray[wp.bool], force: DeviceGrid[wp.float32]
) -> None:
    """Hold forces [N] in the chosen worlds from now on; one that is no number stays none."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if chosen[i]:
        memory = servo.memory[i]
        for d in range(TENDONS):
            memory = with_held(mechanism, i, d, real(force[i, d]), memory)
        servo.memory[i] = memory


@device_template
def guard_kernel(
    servo: Servo,
    good_q: DeviceArray[JointVector],
    good_memory: DeviceArray[MemoryVector],
    out: NewtonJoints,
    diverged: DeviceArray[wp.bool],
) -> None:
    """Put a world that left every physical range where it last was, at rest, and mark it."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    q = servo.q[i]
    v = servo.v[i]
    memory = servo.memory[i]
    fine = bool(True)
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
        hand_over(servo, i, good_q[i], JointVector(), good_memory[i], out)


@device_template
def read_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    given: NewtonJoints,
    angle: DeviceGrid[wp.float32],
    angle_rate: DeviceGrid[wp.float32],
    force: DeviceGrid[wp.float32],
) -> None:
    """Read encoder and load cell just after the present command was given."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    p = servo.parameters[i]
    here = just_asked(mechanism, servo, history, given, i)
    reading = read_sensors(mechanism, p, here)
    for d in range(TENDONS):
        angle[i, d] = wp.float32(reading.angle[d])
        angle_rate[i, d] = wp.float32(reading.angle_rate[d])
        force[i, d] = wp.float32(cell_effects(reading.force[d], here.time, d, p))
