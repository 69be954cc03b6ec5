"""Kernels of mechanisms that move a free body: one thread steps all chains of a world, in turn.

The body is a part of each chain that touches it. Each of several chains is stepped with the body
under what the others last did to it, and the body goes where the last chain leaves it: impulses in
sequence, as engines for rigid bodies find contact forces. A second round lets the first chain know
what the last one did.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    BODY,
    CHAINS,
    CONTACT_TABLE,
    CONTACTS,
    FIRST_BODY,
    SHARES_BODY,
    DeviceArray,
    JointVector,
    Quaternion,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import (
    Commands,
    Drive,
    Mechanism,
    Motion,
    NewtonJoints,
    Servo,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.contact.contacts import WITHIN, grip_at, pose_at
from tendon_newton.simulation.contact.free_body import (
    body_weight,
    frame_of,
    home_of,
    inertia_of_body,
    quaternion_of,
    turn_in,
    way_in,
    with_body,
)
from tendon_newton.simulation.dynamics.integrator import step
from tendon_newton.simulation.kernels.acting_command import mean_command
from tendon_newton.simulation.kernels.control_kernels import (
    FARTHEST,
    hand_over,
    past_of,
    resumed,
    servo_drive,
    tendon_command,
)
from tendon_newton.simulation.tendons.routes import placed

# Rounds over the chains of a world in a step. With two, no mode of up to four fingers and a body of
# 10 g or more grows at 0.5 ms: tips of 1 g to 30 kg press with up to 20 N
# (tests/physics/contact/test_rounds.py).
ROUNDS = 2


@device_template
def put_body(mechanism: Mechanism, servo: Servo, home: int) -> None:
    """Let contacts meet the body where it is."""
    mechanism.obstacle_position[home, wp.static(BODY)] = servo.body_place[home]
    mechanism.obstacle_rotation[home, wp.static(BODY)] = frame_of(servo.body_turn[home])


@device_template
def take_speeds(servo: Servo, home: int, velocity: Vec3, spin: Vec3) -> None:
    """Give all chains of a world a body that has not moved yet, and its speeds."""
    chains = int(CHAINS)
    for c in range(chains):
        i = home * chains + c
        servo.q[i] = with_body(servo.q[i], Vec3(), Vec3())
        servo.v[i] = with_body(servo.v[i], velocity, spin)


@device_template
def resume_body(mechanism: Mechanism, servo: Servo, given: NewtonJoints, home: int) -> None:
    """Go on with the body where Newton has it, with all digits where those are our own rounded."""
    at = servo.body_position_index[home]
    place = servo.body_place[home]
    turn = servo.body_turn[home]
    turned = bool(False)
    for k in range(3):
        if wp.float32(place[k]) != given.position[at + k]:
            place[k] = real(given.position[at + k])
    for k in range(4):
        turned = turned or wp.float32(turn[k]) != given.position[at + 3 + k]
    if turned:
        turn = wp.normalize(
            Quaternion(
                real(given.position[at + 3]),
                real(given.position[at + 4]),
                real(given.position[at + 5]),
                real(given.position[at + 6]),
            )
        )
    own = servo.v[home * wp.static(CHAINS)]
    rate = servo.body_velocity_index[home]
    for k in range(6):
        if wp.float32(own[wp.static(FIRST_BODY) + k]) != given.velocity[rate + k]:
            own[wp.static(FIRST_BODY) + k] = real(given.velocity[rate + k])
    servo.body_place[home] = place
    servo.body_turn[home] = turn
    take_speeds(servo, home, way_in(own), turn_in(own))
    put_body(mechanism, servo, home)


@device_template
def tell_body(servo: Servo, home: int, out: NewtonJoints) -> None:
    """Tell Newton where the body is, and how fast."""
    at = servo.body_position_index[home]
    place = servo.body_place[home]
    turn = servo.body_turn[home]
    own = servo.v[home * wp.static(CHAINS)]
    rate = servo.body_velocity_index[home]
    for k in range(3):
        out.position[at + k] = wp.float32(place[k])
    for k in range(4):
        out.position[at + 3 + k] = wp.float32(turn[k])
    for k in range(6):
        out.velocity[rate + k] = wp.float32(own[wp.static(FIRST_BODY) + k])


@device_template
def move_body(mechanism: Mechanism, servo: Servo, home: int, end: Motion) -> None:
    """Put the body where a step has left it; its coordinates begin anew."""
    servo.body_place[home] = servo.body_place[home] + way_in(end.q)
    turned = quaternion_of(turn_in(end.q)) * servo.body_turn[home]
    servo.body_turn[home] = wp.normalize(turned)
    take_speeds(servo, home, way_in(end.v), turn_in(end.v))
    put_body(mechanism, servo, home)


@device_template
def load_of_others(servo: Servo, i: int) -> JointVector:
    """Return what the other chains of a world did to the body in their last step [N, N m]."""
    chains = int(CHAINS)
    first = home_of(i) * chains
    push = Vec3()
    twist = Vec3()
    for c in range(chains):
        if first + c != i:
            push = push + servo.body_push[first + c, 0]
            twist = twist + servo.body_push[first + c, 1]
    return with_body(JointVector(), push, twist)


@device_template
def keep_push(mechanism: Mechanism, servo: Servo, start: Drive, end: Motion, h: real) -> None:
    """Keep what a chain did to the body: its change of momentum, less what else acted on it."""
    i = start.world
    velocity = way_in(end.v) - way_in(start.v)
    push = (mechanism.body_mass[home_of(i)] / h) * velocity
    push = push - body_weight(mechanism, start) - way_in(start.load)
    before = inertia_of_body(mechanism, i, start.q) * turn_in(start.v)
    after = inertia_of_body(mechanism, i, end.q) * turn_in(end.v)
    servo.body_push[i, 0] = push
    servo.body_push[i, 1] = (after - before) / h - turn_in(start.load)


@device_template
def take_command(servo: Servo, history: Commands, i: int) -> None:
    """Let the present command into a world's past."""
    log = past_of(history, i)
    newest = log.count - 1
    for k in range(newest):
        history.time[log.first + k] = history.time[log.first + k + 1]
        history.angle[log.first + k] = history.angle[log.first + k + 1]
    history.time[log.first + newest] = servo.time[i]
    history.angle[log.first + newest] = tendon_command(servo, i)


@device_template
def chain_step(
    mechanism: Mechanism, servo: Servo, history: Commands, i: int, substep: int, h: real
) -> Motion:
    """Step one chain and its body by h [s] from where they are."""
    log = past_of(history, i)
    p = servo.parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    drive = placed(drive, servo.q[i], servo.v[i])
    drive.time = servo.time[i] + real(substep) * h
    drive.command = mean_command(history, log, p, drive.time, h, log.count - 1)
    if wp.static(SHARES_BODY):
        drive.load = load_of_others(servo, i)
    end = step(mechanism, p, drive, h)
    if wp.static(SHARES_BODY):
        keep_push(mechanism, servo, drive, end, h)
    return end


@device_template
def body_step_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    substeps: int,
    h: real,
    given: NewtonJoints,
    out: NewtonJoints,
) -> None:
    """Hold the commands of a world for some substeps of h [s]."""
    home = int(wp.tid())  # pyright: ignore[reportArgumentType]
    chains = int(CHAINS)
    rounds = int(wp.static(ROUNDS if SHARES_BODY else 1))
    for c in range(chains):
        i = home * chains + c
        take_command(servo, history, i)
        here = Drive()
        here = resumed(here, servo, given, i)
        servo.q[i] = here.q
        servo.v[i] = here.v
    resume_body(mechanism, servo, given, home)
    for k in range(substeps):
        for lap in range(rounds):
            for c in range(chains):
                i = home * chains + c
                end = chain_step(mechanism, servo, history, i, k, h)
                if lap == rounds - 1:
                    servo.q[i] = end.q
                    servo.v[i] = end.v
                    servo.memory[i] = end.memory
                    if c == chains - 1:
                        move_body(mechanism, servo, home, end)
    for c in range(chains):
        i = home * chains + c
        servo.time[i] = servo.time[i] + real(substeps) * h
        hand_over(servo, i, servo.q[i], servo.v[i], servo.memory[i], out)
    tell_body(servo, home, out)


@device_template
def carry_kernel(
    mechanism: Mechanism, servo: Servo, chosen: DeviceArray[wp.bool], given: NewtonJoints
) -> None:
    """Put bodies where they are; in the chosen worlds, where Newton has them."""
    home = int(wp.tid())  # pyright: ignore[reportArgumentType]
    if chosen[home]:
        resume_body(mechanism, servo, given, home)
    put_body(mechanism, servo, home)


@device_template
def guard_body_kernel(
    servo: Servo,
    good_place: DeviceArray[Vec3],
    good_turn: DeviceArray[Quaternion],
    out: NewtonJoints,
    diverged: DeviceArray[wp.bool],
) -> None:
    """Put a body that left every physical range where it last was, at rest, and mark its world."""
    home = int(wp.tid())  # pyright: ignore[reportArgumentType]
    place = servo.body_place[home]
    turn = servo.body_turn[home]
    own = servo.v[home * wp.static(CHAINS)]
    speed = wp.length(way_in(own)) + wp.length(turn_in(own))
    if wp.length(place) + speed < real(FARTHEST) and wp.isfinite(wp.length(turn)):
        good_place[home] = place
        good_turn[home] = turn
    else:
        diverged[home] = wp.bool(True)
        servo.body_place[home] = good_place[home]
        servo.body_turn[home] = good_turn[home]
        take_speeds(servo, home, Vec3(), Vec3())
        tell_body(servo, home, out)


@device_template
def contact_kernel(
    mechanism: Mechanism, servo: Servo, given: NewtonJoints, force: wp.array3d[wp.vec3f]
) -> None:
    """Add up what obstacles do to each capsule [N], in the axes of the base."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    drive = Drive()
    drive.world = i
    drive.memory = servo.memory[i]
    here = resumed(drive, servo, given, i)
    pose = pose_at(mechanism, i, here.q)
    count = int(CONTACTS)
    for contact in range(count):
        own = grip_at(mechanism, here, pose, contact, real(WITHIN))
        push = own.force * own.normal + own.drag
        capsule = CONTACT_TABLE[contact, 0]
        obstacle = CONTACT_TABLE[contact, 1]
        pushed = wp.vec3f(wp.float32(push[0]), wp.float32(push[1]), wp.float32(push[2]))
        if capsule >= 0:
            force[i, capsule, obstacle] = force[i, capsule, obstacle] + pushed
