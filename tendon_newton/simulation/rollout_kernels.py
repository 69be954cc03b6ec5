"""Kernels that take worlds through the rows of a recording, one thread a world."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    JOINTS,
    TENDONS,
    Jet,
    JointMatrix,
    JointVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.integrator import (
    choose_modes,
    excursion,
    pull,
    smooth_forces,
    step,
    touching,
)
from tendon_newton.simulation.pipeline import motor_force, tendon_state, tension

Commands: Any = None
Drive: Any = None
Forces: Any = None
Mechanism: Any = None
Modes: Any = None
Reading: Any = None
angle_effects: Any = None
clock_effects: Any = None
sensor_effects: Any = None

SETTLING_STEPS = 400
"""Steps of the pseudo-transient that finds an equilibrium; its step grows by a factor each time."""
GUIDE_STIFFNESS = 1.0e6
"""Stiffness [N/m] of the guide that brings a tendon to a measured angle at the start."""


@device_template
def find_row(commands: Commands, first: int, count: int, instant: real, guess: int) -> int:
    """Return the row whose command is in force at an instant [s]; the first row's command holds before it."""
    row = guess
    while row + 1 < count and commands.time[first + row + 1] <= instant:
        row = row + 1
    while row > 0 and commands.time[first + row] > instant:
        row = row - 1
    return row


@device_template
def command_mean(
    commands: Commands, first: int, count: int, row: int, start: real, end: real
) -> TendonVector:
    """Return the mean [rad] of the staircase of commands between two instants [s] that at most one edge separates."""
    before = find_row(commands, first, count, start, row)
    after = find_row(commands, first, count, end, before)
    command = commands.angle[first + after]
    if after > before:
        edge = commands.time[first + after]
        share = (edge - start) / (end - start)
        command = command + share * (commands.angle[first + before] - command)
    return command


@device_template
def row_drive(commands: Commands, first: int, row: int) -> Drive:
    """Return what a row says of the drive besides its command."""
    drive = Drive()
    drive.voltage = commands.voltage[first + row]
    drive.enabled = commands.enabled[first + row]
    return drive


@device_template
def tension_now(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, modes: Modes,
    d: int, length: real, rate: real,
) -> real:  # fmt: skip
    """Return the tension at the load cell [N]; where the tendon sticks, what holds it."""
    tendon = tendon_state(mechanism, world, drive, d, length, rate)
    force = motor_force(mechanism, world, p, drive, d, tendon)
    if modes.tendon_sticks[d] == real(0.0):
        tendon.direction = modes.tendon[d]
        sliding = tension(mechanism, world, p, d, force, tendon)
        return sliding[0]
    tendon.direction = real(1.0)
    least = tension(mechanism, world, p, d, force, tendon)
    tendon.direction = real(-1.0)
    most = tension(mechanism, world, p, d, force, tendon)
    felt_least = pull(mechanism, world, p, drive, d, length, rate, real(1.0))
    felt_most = pull(mechanism, world, p, drive, d, length, rate, real(-1.0))
    share = (modes.hold[d] - felt_least[0]) / (felt_most[0] - felt_least[0])
    return least[0] + share * (most[0] - least[0])


@device_template
def read_sensors(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, q: JointVector, v: JointVector
) -> Reading:
    """Return what encoder and load cell report just after a command took effect."""
    modes = choose_modes(mechanism, world, p, drive, q, v)
    reading = Reading()
    for d in range(TENDONS):
        length = mechanism.excursion_offset[world][d] + excursion(mechanism.arms[world], d, q)
        rate = excursion(mechanism.arms[world], d, v)
        tendon = tendon_state(mechanism, world, drive, d, length, rate)
        angle = angle_effects(tendon.angle, tendon, p)
        reading.angle[d] = angle[0]
        reading.angle_rate[d] = rate / tendon.spool_radius
        reading.force[d] = tension_now(mechanism, world, p, drive, modes, d, length, rate)
    return reading


@device_template
def frictionless_forces(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, guided: bool,
    target: TendonVector, q: JointVector,
) -> Forces:  # fmt: skip
    """Return forces at rest without dry friction; guided, a stiff guide to measured angles replaces the tendon."""
    modes = Modes()
    v = JointVector()
    modes.touch = touching(mechanism, world, q, v)
    if guided:
        for d in range(TENDONS):
            modes.tendon_sticks[d] = real(1.0)
    forces = smooth_forces(mechanism, world, p, drive, modes, q, v)
    if guided:
        arms = mechanism.arms[world]
        for d in range(TENDONS):
            length = mechanism.excursion_offset[world][d] + excursion(arms, d, q)
            tendon = tendon_state(mechanism, world, drive, d, length, real(0.0))
            angle = angle_effects(tendon.angle, tendon, p)
            guide = real(GUIDE_STIFFNESS) * tendon.spool_radius * (target[d] - angle[0])
            for i in range(JOINTS):
                forces.torque[i] = forces.torque[i] + arms[d, i] * guide
                for j in range(JOINTS):
                    forces.stiffness[i, j] = (
                        forces.stiffness[i, j] - real(GUIDE_STIFFNESS) * arms[d, i] * arms[d, j]
                    )
    return forces


@device_template
def settle_kernel(
    first_world: int,
    mechanism: Mechanism,
    world_mechanism: wp.array(dtype=int),
    world_recording: wp.array(dtype=int),
    parameters: wp.array(dtype=ParameterVector),
    commands: Commands,
    q: wp.array(dtype=JointVector),
    v: wp.array(dtype=JointVector),
) -> None:
    """Put each world where its recording starts: in friction-free equilibrium, or at the first row's angle and speed."""
    i = first_world + wp.tid()
    world = world_mechanism[i]
    recording = world_recording[i]
    first = commands.first[recording]
    p = parameters[i]
    drive = row_drive(commands, first, 0)
    drive.time = commands.time[first]
    drive.command = commands.angle[first]
    guided = commands.starts_measured[recording] > 0
    target = commands.start_angle[recording]
    x = JointVector()
    for j in range(JOINTS):
        x[j] = wp.clamp(
            mechanism.rest[world][j], mechanism.lower[world][j], mechanism.upper[world][j]
        )
    pace = real(0.003)  # pseudo time step [s]
    for _step in range(SETTLING_STEPS):
        forces = frictionless_forces(mechanism, world, p, drive, guided, target, x)
        change = inverse(forces.mass_matrix / (pace * pace) - forces.stiffness) * forces.torque
        x = x + change
        pace = wp.min(pace * real(1.05), real(10.0))
    q[i] = x
    speed = JointVector()
    if guided:
        arms = mechanism.arms[world]
        for d in range(TENDONS):
            rate = commands.start_rate[recording][d] * mechanism.spool_radius[world][d]
            speed = speed + arms[d] * (rate / wp.dot(arms[d], arms[d]))
    v[i] = speed


@device_template
def rollout_kernel(
    first_world: int,
    mechanism: Mechanism,
    world_mechanism: wp.array(dtype=int),
    world_recording: wp.array(dtype=int),
    parameters: wp.array(dtype=ParameterVector),
    commands: Commands,
    rows_from: int,
    rows_to: int,
    time_step: real,
    q: wp.array(dtype=JointVector),
    v: wp.array(dtype=JointVector),
    output_first: wp.array(dtype=int),
    joint_position: wp.array(dtype=JointVector),
    angle: wp.array(dtype=TendonVector),
    angle_rate: wp.array(dtype=TendonVector),
    force: wp.array(dtype=TendonVector),
) -> None:
    """Simulate each world's recording from one row to another; q and v carry the state on."""
    i = first_world + wp.tid()
    world = world_mechanism[i]
    recording = world_recording[i]
    first = commands.first[recording]
    count = commands.count[recording]
    p = parameters[i]
    x = q[i]
    xd = v[i]
    acting = int(rows_from)
    for row in range(rows_from, wp.min(rows_to, count)):
        now = commands.time[first + row]
        drive = row_drive(commands, first, row)
        drive.time = now
        acting = find_row(commands, first, count, clock_effects(now, p), acting)
        drive.command = commands.angle[first + acting]
        reading = read_sensors(mechanism, world, p, drive, x, xd)
        out = output_first[i] + row
        joint_position[out] = x
        angle[out] = reading.angle
        angle_rate[out] = reading.angle_rate
        force[out] = reading.force
        if row + 1 < count:
            interval = commands.time[first + row + 1] - now
            steps = int(wp.ceil(interval / time_step - real(1.0e-6)))
            h = interval / real(steps)
            for k in range(steps):
                drive.time = now + real(k) * h
                drive.command = command_mean(
                    commands, first, count, acting,
                    clock_effects(drive.time, p), clock_effects(drive.time + h, p),
                )  # fmt: skip
                motion = step(mechanism, world, p, drive, x, xd, h)
                x = motion.q
                xd = motion.v
    q[i] = x
    v[i] = xd
