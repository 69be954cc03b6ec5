"""Kernels of mechanisms that move a free body: each chain has a copy of it, and they agree.

The body is a part of each chain that touches it. Half the chains of a world are stepped side by
side, then the other half. Each has a copy of the body, under what the others did to it as far as
that is known; where all know that, all copies move as the body does. The copies weigh `BODY_SHARE`
of the body, since those that are stepped at once do not know of each other. A second round lets
each chain know what all others do in this very step. Then the body takes up what they did to it.

Source: Tonge, Benevolenski, Voroshilov, Mass splitting for jitter-free parallel rigid body
simulation, ACM Trans. Graph. 31 (2012), for the copies.

On CUDA one thread steps each of the chains that are stepped side by side, and those of a world wait
for each other; on a CPU one thread steps all.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    ABREAST,
    BODY,
    BODY_SHARE,
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
    frame_of,
    home_of,
    inertia_of_body,
    quaternion_of,
    turn_in,
    way_in,
    with_body,
)
from tendon_newton.simulation.dynamics.integrator import step, undivided_step
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
# (tests/physics/contact/test_rounds.py). An even number: the pushes of the last round stand where
# the next step looks for them.
ROUNDS = 2


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    __syncthreads();
#endif
""")
def wait_for_all() -> None:
    """Let the threads of a block, which hold all chains of their worlds, wait for each other."""


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
def load_of_others(servo: Servo, i: int, lap: int) -> JointVector:
    """Return what lets a chain's copy of the body move as the body does [N, N m]."""
    chains = int(CHAINS)
    abreast = int(ABREAST)
    first = home_of(i) * chains
    group = (i - first) // abreast
    last = int(2) * (lap % int(2))
    now = int(2) - last
    push = -servo.body_push[i, last]
    twist = -servo.body_push[i, last + 1]
    for c in range(chains):
        known = last
        if c // abreast < group:  # already stepped in this round
            known = now
        push = push + wp.static(BODY_SHARE) * servo.body_push[first + c, known]
        twist = twist + wp.static(BODY_SHARE) * servo.body_push[first + c, known + 1]
    return with_body(JointVector(), push, twist)


@device_template
def keep_push(
    mechanism: Mechanism, servo: Servo, start: Drive, end: Motion, h: real, lap: int
) -> None:
    """Keep what a chain and its part of the weight did to the body, for the next round."""
    i = start.world
    share = wp.static(BODY_SHARE) / h
    velocity = way_in(end.v) - way_in(start.v)
    before = inertia_of_body(mechanism, i, start.q) * turn_in(start.v)
    after = inertia_of_body(mechanism, i, end.q) * turn_in(end.v)
    mass = mechanism.body_mass[home_of(i)]
    now = int(2) * ((lap + int(1)) % int(2))
    servo.body_push[i, now] = share * mass * velocity - way_in(start.load)
    servo.body_push[i, now + 1] = share * (after - before) - turn_in(start.load)


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
def step_chain(
    mechanism: Mechanism, servo: Servo, history: Commands, i: int, substep: int, lap: int, h: real
) -> None:
    """Step one chain by h [s] from where it is; the last round is kept, and meets events.

    Its body stays as fast as it was, until it is known what all chains do to it.
    """
    log = past_of(history, i)
    p = servo.parameters[i]
    drive = servo_drive(mechanism, p, servo, i)
    drive = placed(drive, servo.q[i], servo.v[i])
    drive.time = servo.time[i] + real(substep) * h
    drive.command = mean_command(history, log, p, drive.time, h, log.count - 1)
    if wp.static(SHARES_BODY):
        drive.load = load_of_others(servo, i, lap)
    if lap + 1 < wp.static(ROUNDS if SHARES_BODY else 1):
        foreseen = undivided_step(mechanism, p, drive, h)
        if wp.static(SHARES_BODY):
            keep_push(mechanism, servo, drive, foreseen, h, lap)
    else:
        end = step(mechanism, p, drive, h)
        servo.q[i] = end.q
        servo.v[i] = end.v
        servo.memory[i] = end.memory
        if wp.static(SHARES_BODY):
            keep_push(mechanism, servo, drive, end, h, lap)
            servo.v[i] = with_body(end.v, way_in(drive.v), turn_in(drive.v))


@device_template
def move_body(mechanism: Mechanism, servo: Servo, home: int, h: real) -> None:
    """Put a body where a step of h [s] has left it; its coordinates begin anew."""
    chains = int(CHAINS)
    first = home * chains
    q = servo.q[first]
    velocity = way_in(servo.v[first])
    spin = turn_in(servo.v[first])
    if wp.static(SHARES_BODY):
        push = Vec3()
        twist = Vec3()
        way = Vec3()
        turn = Vec3()
        for c in range(chains):
            push = push + servo.body_push[first + c, 0]
            twist = twist + servo.body_push[first + c, 1]
            way = way + way_in(servo.q[first + c])
            turn = turn + turn_in(servo.q[first + c])
        still = with_body(q, Vec3(), Vec3())
        momentum = inertia_of_body(mechanism, first, still) * spin + h * twist
        q = with_body(q, way / real(chains), turn / real(chains))
        velocity = velocity + (h / mechanism.body_mass[home]) * push
        spin = wp.inverse(inertia_of_body(mechanism, first, q)) * momentum
    servo.body_place[home] = servo.body_place[home] + way_in(q)
    turned = quaternion_of(turn_in(q)) * servo.body_turn[home]
    servo.body_turn[home] = wp.normalize(turned)
    take_speeds(servo, home, velocity, spin)
    put_body(mechanism, servo, home)


@device_template
def begin_step(
    mechanism: Mechanism, servo: Servo, history: Commands, given: NewtonJoints, home: int
) -> None:
    """Let the commands of a world in, and go on where Newton has it."""
    chains = int(CHAINS)
    for i in range(home * chains, (home + 1) * chains):
        take_command(servo, history, i)
        here = Drive()
        here = resumed(here, servo, given, i)
        servo.q[i] = here.q
        servo.v[i] = here.v
    resume_body(mechanism, servo, given, home)


@device_template
def end_step(servo: Servo, duration: real, out: NewtonJoints, home: int) -> None:
    """Tell Newton where a world is after so long [s]."""
    chains = int(CHAINS)
    for i in range(home * chains, (home + 1) * chains):
        servo.time[i] = servo.time[i] + duration
        hand_over(servo, i, servo.q[i], servo.v[i], servo.memory[i], out)
    tell_body(servo, home, out)


@device_template
def body_step_kernel(
    mechanism: Mechanism,
    servo: Servo,
    history: Commands,
    own: int,
    substeps: int,
    h: real,
    given: NewtonJoints,
    out: NewtonJoints,
) -> None:
    """Hold the commands of worlds for some substeps of h [s].

    A thread steps so many of the chains that are stepped side by side: all of them, or one.
    """
    chains = int(CHAINS)
    abreast = int(ABREAST)
    first = own * int(wp.tid())  # pyright: ignore[reportArgumentType]
    home = first // abreast
    place = first - home * abreast
    if place == 0:
        begin_step(mechanism, servo, history, given, home)
    wait_for_all()
    for substep in range(substeps):
        for lap in range(wp.static(ROUNDS if SHARES_BODY else 1)):
            for group in range(0, chains, abreast):
                for c in range(group + place, wp.min(group + place + own, chains)):
                    step_chain(mechanism, servo, history, home * chains + c, substep, lap, h)
                wait_for_all()
        if place == 0:
            move_body(mechanism, servo, home, h)
        wait_for_all()
    if place == 0:
        end_step(servo, real(substeps) * h, out, home)


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
