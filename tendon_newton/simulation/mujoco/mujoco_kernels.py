"""Kernels that let another solver of Newton's feel the same tendons.

The same stages, applied as joint forces.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    TENDONS,
    ArmMatrix,
    DeviceArray,
    DeviceGrid,
    JointVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    Vec2,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.sensors import INSTANT
from tendon_newton.simulation.kernels.history_kernels import all_present, push_samples
from tendon_newton.simulation.kernels.rollout_kernels import acting_row, command_mean, find_row
from tendon_newton.simulation.tendons.pipeline import (
    damping_torque,
    excursion,
    flow_at,
    joint_state,
    spring_torque,
)
from tendon_newton.simulation.tendons.routes import located, tendon_arms, tendon_bow
from tendon_newton.simulation.tendons.spools import rotor_inertia
from tendon_newton.simulation.tendons.world_drive import at_end, world_drive

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Reading = Placeholder
Track = Placeholder
cell_effects: Any = None
clock_effects: Any = None
HAS_MEMORY = False
HAS_ROTOR = False
"""Whether a rotor's inertia stands between the motor and the load cell."""
HOLDS_FORCE = False
"""Whether the actuator's force is decided outside the kernel and held."""

SLIDING_SPEED = 1.0e-3
"""Width of the smoothed sign of dry friction on a tendon [m/s]: below it the tendon creeps, where
ours would stick."""


@device_template
def smooth_share(arms: ArmMatrix, d: int, v: JointVector) -> real:
    """Return how much a tendon slides in (1) rather than out (0)."""
    slide = wp.clamp(excursion(arms, d, v) / real(SLIDING_SPEED), real(-1.0), real(1.0))
    return real(0.5) * (real(1.0) + slide)


@device_template
def sliding_modes(arms: ArmMatrix, v: JointVector) -> Modes:
    """Return modes in which every tendon slides the way it moves."""
    modes = Modes()
    for d in range(TENDONS):
        modes.tendon[d] = real(1.0)
        if excursion(arms, d, v) < real(0.0):
            modes.tendon[d] = real(-1.0)
    return modes


@device_template
def tendon_pull(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    rate: real,
    slack: bool,
) -> Vec2:
    """Return the tension at the load cell [N] and the pull on the mechanism [N].

    Args:
        mechanism: Numbers of all benches.
        world: Which of them.
        p: Numbers of actuator and effects.
        drive: What acts on the world, located at q and v.
        d: The tendon.
        q: Joint positions [rad, m].
        v: Their rates.
        rate: How the tendon's excursion accelerates [m/s2], which a rotor feels.
        slack: Whether the string of a rotor has come loose.
    """
    share = smooth_share(tendon_arms(mechanism, world, drive), d, v)
    inward = flow_at(mechanism, world, p, drive, d, q, v, real(1.0))
    outward = flow_at(mechanism, world, p, drive, d, q, v, real(-1.0))
    tension = share * inward.tension[0] + (real(1.0) - share) * outward.tension[0]
    pull = share * inward.pull[0] + (real(1.0) - share) * outward.pull[0]
    if wp.static(HAS_ROTOR):
        rotor = rotor_inertia(mechanism, world, p, d) * rate
        gain = share * inward.tension_gain + (real(1.0) - share) * outward.tension_gain
        pulled = share * inward.pull_gain + (real(1.0) - share) * outward.pull_gain
        left = tension - gain * rotor
        if slack:
            left = real(0.0)
        if gain > real(0.0):
            pull = pull - pulled / gain * (tension - left)
        tension = left
    return Vec2(tension, pull)


@device_template
def joint_numbers(values: DeviceArray[wp.float32], index: DeviceGrid[int], i: int) -> JointVector:
    """Return a world's joint positions or velocities."""
    out = JointVector()
    for j in range(JOINTS):
        out[j] = real(values[index[i, j]])
    return out


@device_template
def push_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    time_step: real,
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    joint_q: DeviceArray[wp.float32],
    joint_v: DeviceArray[wp.float32],
    track: Track,
    joint_f: DeviceArray[wp.float32],
) -> None:
    """Write the joint forces for the substep to come, and note the state at its start."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    n = track.count[i]
    p = parameters[i]
    first = commands.first[i]
    q = joint_numbers(joint_q, position_index, i)
    v = joint_numbers(joint_v, velocity_index, i)
    drive = world_drive(mechanism, i, p)
    drive.time = real(n) * time_step
    drive.memory = track.latest[i]
    drive = located(mechanism, i, drive, q, v)
    arms = tendon_arms(mechanism, i, drive)
    row = find_row(commands, first, commands.count[i], clock_effects(drive.time, p), track.row[i])
    drive.voltage = commands.voltage[first + row]
    drive.enabled = commands.enabled[first + row]
    if wp.static(HAS_MEMORY):  # noqa: SIM102 - decided when the kernel is made
        if n > 0:
            drive.command = track.command[i]
            later = at_end(drive, time_step, (v - track.v[n - 1, i]) / time_step)
            drive.memory = remembered(mechanism, i, p, later, sliding_modes(arms, v), q, v)
    drive.command = command_mean(
        commands,
        first,
        commands.count[i],
        row,
        clock_effects(drive.time, p),
        clock_effects(drive.time + time_step, p),
    )
    torque = JointVector()
    acceleration = JointVector()
    before = drive
    if wp.static(HAS_ROTOR):  # noqa: SIM102 - decided when the kernel is made
        if n > 0:
            acceleration = (v - track.v[n - 1, i]) / time_step
            before.command = track.command[i]
    bow = tendon_bow(drive)
    for d in range(TENDONS):
        acting = excursion(arms, d, acceleration) + bow[d]
        slack = bool(False)  # noqa: UP018 - a variable for Warp, not a constant
        if wp.static(HAS_ROTOR):
            # by the command under which it has accelerated so: a new one changes both at once
            past = tendon_pull(mechanism, i, p, before, d, q, v, acting, False)
            slack = past[0] < mechanism.least_tension[i][d]
        force = tendon_pull(mechanism, i, p, drive, d, q, v, acting, slack)
        pull = force[1]
        if wp.static(HAS_ROTOR):
            # MuJoCo's own armature, which is implicit, takes this off again
            pull = pull + rotor_inertia(mechanism, i, p, d) * acting
        if wp.static(HOLDS_FORCE):
            # MuJoCo's own damper, which is implicit, takes this off again
            rate = excursion(arms, d, v)
            pull = pull + p[1] * rate / mechanism.spool_radius[i][d]
        torque = torque + arms[d] * pull
    for j in range(JOINTS):
        joint = joint_state(mechanism, i, drive, j, q, v)
        own = spring_torque(joint, p) + damping_torque(joint, p)
        # What the other solver applies already is taken off again: only the effects' part remains.
        plain = joint.stiffness * (q[j] - joint.rest) + joint.damping * v[j]
        joint_f[velocity_index[i, j]] = wp.float32(torque[j] + own[0] + plain)
    track.q[n, i] = q
    track.v[n, i] = v
    track.memory[n, i] = drive.memory
    track.latest[i] = drive.memory
    track.command[i] = drive.command
    track.row[i] = row
    track.count[i] = n + 1


@device_template
def track_reading_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    time_step: real,
    row_world: DeviceArray[int],
    track: Track,
    joint_position: DeviceArray[JointVector],
    motor_position: DeviceArray[TendonVector],
    motor_velocity: DeviceArray[TendonVector],
    force: DeviceArray[TendonVector],
) -> None:
    """Read encoder and load cell in every row, between two noted states in a straight line."""
    out = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    i = row_world[out]
    p = parameters[i]
    first = commands.first[i]
    now = commands.time[out]
    n = int(now / time_step + real(1.0e-6))
    share = wp.max(now / time_step - real(n), real(0.0))
    q = track.q[n, i] + share * (track.q[n + 1, i] - track.q[n, i])
    v = track.v[n, i] + share * (track.v[n + 1, i] - track.v[n, i])
    drive = world_drive(mechanism, i, p)
    drive.time = now
    drive.memory = track.memory[n, i]
    drive.voltage = commands.voltage[out]
    drive.enabled = commands.enabled[out]
    count = commands.count[i]
    acting = acting_row(commands, first, count, now, real(1.0), p, out - first)
    drive.command = commands.angle[first + acting]
    joint_position[out] = q
    drive = located(mechanism, i, drive, q, v)
    arms = tendon_arms(mechanism, i, drive)
    acceleration = (track.v[n + 1, i] - track.v[n, i]) / time_step
    bow = tendon_bow(drive)
    for d in range(TENDONS):
        rate = excursion(arms, d, acceleration) + bow[d]
        tension = tendon_pull(mechanism, i, p, drive, d, q, v, rate, False)
        flow = flow_at(mechanism, i, p, drive, d, q, v, real(1.0))
        motor_position[out][d] = flow.angle[0]
        motor_velocity[out][d] = flow.angle[1] * excursion(arms, d, v)
        least = mechanism.least_tension[i][d]
        force[out][d] = cell_effects(wp.max(tension[0], least), now, p)


@device_template
def track_sense_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    time_step: real,
    position_index: DeviceGrid[int],
    velocity_index: DeviceGrid[int],
    joint_q: DeviceArray[wp.float32],
    joint_v: DeviceArray[wp.float32],
    track: Track,
    ring: wp.array3d[wp.float32],
    newest: DeviceArray[int],
) -> None:
    """Show force networks each world at the start of the substep to come.

    From then on forces are reckoned from there.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    p = parameters[i]
    first = commands.first[i]
    q = joint_numbers(joint_q, position_index, i)
    v = joint_numbers(joint_v, velocity_index, i)
    drive = world_drive(mechanism, i, p)
    drive.time = real(track.count[i]) * time_step
    drive.memory = track.latest[i]
    instant = clock_effects(drive.time, p) + real(INSTANT)
    row = find_row(commands, first, commands.count[i], instant, track.row[i])
    drive.voltage = commands.voltage[first + row]
    drive.enabled = commands.enabled[first + row]
    drive.command = commands.angle[first + row]
    drive = located(mechanism, i, drive, q, v)
    arms = tendon_arms(mechanism, i, drive)
    reading = Reading()
    for d in range(TENDONS):
        flow = flow_at(mechanism, i, p, drive, d, q, v, real(1.0))
        reading.angle[d] = flow.angle[0]
        reading.angle_rate[d] = flow.angle[1] * excursion(arms, d, v)
    push_samples(mechanism, i, p, drive, q, v, reading, i * TENDONS, 0, ring, newest)
    track.latest[i] = all_present(mechanism, i, p, drive, q, v)
