"""Kernels that let another solver of Newton's feel the same tendons.

The stages of our own solver act as joint forces.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    HAS_MEMORY,
    HAS_ROTOR,
    HOLDS_FORCE,
    JOINTS,
    TENDONS,
    ArmMatrix,
    DeviceArray,
    DeviceGrid,
    JointVector,
    ParameterVector,
    TendonVector,
    Vec2,
    real,
)
from tendon_newton.device_code.slots import cell_effects, clock_effects
from tendon_newton.device_code.structs import (
    Commands,
    ContactStates,
    Drive,
    Mechanism,
    NewtonJoints,
    Reading,
    Readout,
    Samples,
    Track,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.joint import damping_torque, spring_torque
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.kernels.acting_command import (
    acting_command,
    acting_row,
    find_row,
    just_after_row,
    log_of,
    mean_command,
)
from tendon_newton.simulation.kernels.history_kernels import all_present, push_samples
from tendon_newton.simulation.tendons.routes import located, tendon_arms, tendon_bow
from tendon_newton.simulation.tendons.spools import rotor_inertia
from tendon_newton.simulation.tendons.states import excursion, flow_at, joint_state
from tendon_newton.simulation.tendons.world_drive import at_end, world_drive

# Width of the smoothed sign of dry friction on a tendon [m/s]: below it the tendon creeps, where
# ours would stick
SLIDING_SPEED = 1.0e-3


@device_template
def smooth_share(arms: ArmMatrix, d: int, v: JointVector) -> real:
    """Return how much a tendon slides in (1) rather than out (0)."""
    slide = wp.clamp(excursion(arms, d, v) / real(SLIDING_SPEED), real(-1.0), real(1.0))
    return real(0.5) * (real(1.0) + slide)


@device_template
def sliding_contact_states(arms: ArmMatrix, v: JointVector) -> ContactStates:
    """Return contact states in which every tendon slides the way it moves."""
    contact = ContactStates()
    for d in range(TENDONS):
        contact.row_side[d] = real(1.0)
        if excursion(arms, d, v) < real(0.0):
            contact.row_side[d] = real(-1.0)
    return contact


@device_template
def tendon_pull(
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, rate: real, slack: bool
) -> Vec2:
    """Return the tension at the load cell [N] and the pull on the mechanism [N].

    The excursion accelerates at a rate [m/s2], which a rotor feels; its string may be slack.
    """
    arms = tendon_arms(mechanism, here)
    share = smooth_share(arms, d, here.v)
    inward = flow_at(mechanism, p, here, d, real(1.0))
    outward = flow_at(mechanism, p, here, d, real(-1.0))
    tension = share * inward.tension[0] + (real(1.0) - share) * outward.tension[0]
    pull = share * inward.pull[0] + (real(1.0) - share) * outward.pull[0]
    if wp.static(HAS_ROTOR):
        rotor = rotor_inertia(mechanism, here.world, p, d) * rate
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
def tracked(mechanism: Mechanism, track: Track, given: NewtonJoints, i: int) -> Drive:
    """Return a world at the start of the substep to come, but for what its row decides."""
    drive = world_drive(mechanism, i, track.parameters[i])
    drive.time = real(track.count[i]) * track.time_step
    drive.memory = track.latest[i]
    q = joint_numbers(given.position, track.position_index, i)
    v = joint_numbers(given.velocity, track.velocity_index, i)
    return located(mechanism, drive, q, v)


@device_template
def push_kernel(
    mechanism: Mechanism,
    commands: Commands,
    track: Track,
    given: NewtonJoints,
    joint_f: DeviceArray[wp.float32],
) -> None:
    """Write the joint forces for the substep to come, and note the state at its start."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    n = track.count[i]
    p = track.parameters[i]
    log = log_of(commands, i, p)
    here = tracked(mechanism, track, given, i)
    q = here.q
    v = here.v
    arms = tendon_arms(mechanism, here)
    row = find_row(commands, log, clock_effects(here.time, 0, p), track.row[i])
    here.voltage = commands.voltage[log.first + row]
    here.enabled = commands.enabled[log.first + row]
    if wp.static(HAS_MEMORY):
        if n > 0:
            here.command = track.command[i]
            later = at_end(here, track.time_step, (v - track.v[n - 1, i]) / track.time_step)
            sliding = sliding_contact_states(arms, v)
            here.memory = remembered(mechanism, p, later, sliding)
    here.command = mean_command(commands, log, p, here.time, track.time_step, row)
    torque = JointVector()
    acceleration = JointVector()
    before = here
    if wp.static(HAS_ROTOR):
        if n > 0:
            acceleration = (v - track.v[n - 1, i]) / track.time_step
            before.command = track.command[i]
    bow = tendon_bow(here)
    for d in range(TENDONS):
        acting = excursion(arms, d, acceleration) + bow[d]
        slack = bool(False)
        if wp.static(HAS_ROTOR):
            # by the command under which it has accelerated so: a new one changes both at once
            past = tendon_pull(mechanism, p, before, d, acting, False)
            slack = past[0] < mechanism.least_tension[i][d]
        force = tendon_pull(mechanism, p, here, d, acting, slack)
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
        joint = joint_state(mechanism, here, j)
        own = spring_torque(joint, p) + damping_torque(joint, p)
        # What the other solver applies already is taken off again: only the effects' part remains.
        plain = joint.stiffness * (q[j] - joint.rest) + joint.damping * v[j]
        joint_f[track.velocity_index[i, j]] = wp.float32(torque[j] + own[0] + plain)
    track.q[n, i] = q
    track.v[n, i] = v
    track.memory[n, i] = here.memory
    track.latest[i] = here.memory
    track.command[i] = here.command
    track.row[i] = row
    track.count[i] = n + 1


@device_template
def track_reading_kernel(
    mechanism: Mechanism,
    commands: Commands,
    track: Track,
    row_world: DeviceArray[int],
    readout: Readout,
) -> None:
    """Read encoder and load cell in every row, between two noted states in a straight line."""
    out = int(wp.tid())  # pyright: ignore[reportArgumentType]
    i = row_world[out]
    p = track.parameters[i]
    log = log_of(commands, i, p)
    now = commands.time[out]
    n = int(now / track.time_step + real(1.0e-6))
    share = wp.max(now / track.time_step - real(n), real(0.0))
    q = track.q[n, i] + share * (track.q[n + 1, i] - track.q[n, i])
    v = track.v[n, i] + share * (track.v[n + 1, i] - track.v[n, i])
    row = out - log.first
    drive = just_after_row(mechanism, i, p, commands, log, row, track.memory[n, i])
    here = located(mechanism, drive, q, v)
    arms = tendon_arms(mechanism, here)
    acceleration = (track.v[n + 1, i] - track.v[n, i]) / track.time_step
    bow = tendon_bow(here)
    angle = TendonVector()
    speed = TendonVector()
    felt = TendonVector()
    for d in range(TENDONS):
        rate = excursion(arms, d, acceleration) + bow[d]
        tension = tendon_pull(mechanism, p, here, d, rate, False)
        flow = flow_at(mechanism, p, here, d, real(1.0))
        angle[d] = flow.angle[0]
        speed[d] = flow.angle[1] * excursion(arms, d, v)
        least = mechanism.least_tension[i][d]
        felt[d] = cell_effects(real(wp.max(tension[0], least)), now, d, p)
    readout.joint_position[out] = q
    readout.motor_position[out] = angle
    readout.motor_velocity[out] = speed
    readout.force[out] = felt


@device_template
def track_sense_kernel(
    mechanism: Mechanism, commands: Commands, track: Track, given: NewtonJoints, samples: Samples
) -> None:
    """Show force networks each world at the start of the substep to come.

    From then on forces are reckoned from there.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    p = track.parameters[i]
    log = log_of(commands, i, p)
    here = tracked(mechanism, track, given, i)
    row = acting_row(commands, log, p, 0, here.time, track.row[i])
    here.voltage = commands.voltage[log.first + row]
    here.enabled = commands.enabled[log.first + row]
    here.command = acting_command(commands, log, p, here.time, row)
    arms = tendon_arms(mechanism, here)
    reading = Reading()
    for d in range(TENDONS):
        flow = flow_at(mechanism, p, here, d, real(1.0))
        reading.angle[d] = flow.angle[0]
        reading.angle_rate[d] = flow.angle[1] * excursion(arms, d, here.v)
    push_samples(mechanism, p, here, reading, i * TENDONS, 0, samples)
    track.latest[i] = all_present(mechanism, p, here)
