"""What is free to move: falls, rests, slides, rolls, bounces, and is held by a finger."""

import numpy as np
import pytest
import torch

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec
from tendon_newton.mechanisms.geometry.obstacles import STIFFNESS, Box, Plane, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.chains.rotations import rotation_matrices
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.bodies import (
    BODY,
    FAR,
    FLOOR,
    GRAVITY,
    HALF,
    MASS,
    RADIUS,
    RATE,
    SINK,
    STEP,
    WALL,
    brick,
    command,
    fresh,
    later,
    marble,
    motion,
    pose,
    scene_of,
    speeds,
    tilt_floor,
)
from tests.physics.runs import ideal_model, run_of, simulate

AT_REST = -0.1 + RADIUS - SINK  # Height of a ball that rests on the floor [m]


def test_what_nothing_touches_falls_and_turns_freely() -> None:
    """A parabola, and a constant spin."""
    loop = fresh("sphere")
    start, spin = np.array([FAR, 0.0, 0.4]), np.array([3.0, -2.0, 1.0])
    loop.reset(command(), body_pose=pose(start), body_velocity=speeds(0.3, -0.2, 1.0, *spin))
    later(loop, 40)
    time = 40 / RATE
    place, velocity = motion(loop)
    fall = np.array([0.3, -0.2, 1.0]) * time - [0.0, 0.0, 0.5 * GRAVITY * time**2]
    assert place[:3] == pytest.approx(start + fall, abs=1e-6)  # float32 of Newton's state
    assert velocity[3:] == pytest.approx(spin, rel=1e-6)
    angle = np.linalg.norm(spin) * time
    axis = spin / np.linalg.norm(spin)
    turn = [*np.sin(0.5 * angle) * axis, np.cos(0.5 * angle)]
    assert place[3:] == pytest.approx(np.array(turn), abs=1e-6)


def test_a_dropped_ball_rests_where_its_weight_is_borne() -> None:
    """At a depth of m g / k, without any motion left."""
    loop = fresh("sphere")
    loop.reset(command(), body_pose=pose([FAR, 0.0, 0.0]))
    place, velocity = motion(later(loop, 200))
    assert place[2] == pytest.approx(AT_REST, abs=1e-7)  # float32 at 0.1 m; SINK is 1e-4 m
    assert np.max(np.abs(velocity)) < 1e-9


def test_a_sliding_ball_is_slowed_by_friction_until_it_rolls() -> None:
    """By mu g at first; in the end 5/7 of its speed are left, and it rolls."""
    loop = fresh("sphere", friction=0.2)
    loop.reset(
        command(), body_pose=pose([FAR, 0.0, AT_REST]), body_velocity=speeds(0.5, 0, 0, 0, 0, 0)
    )
    loop.step(command())
    _, before = motion(loop)
    _, after = motion(later(loop, 9))
    slowed = (before[0] - after[0]) * RATE / 9
    assert slowed == pytest.approx(0.2 * GRAVITY, rel=1e-4)  # float32 of both speeds
    _, rolling = motion(later(loop, 60))
    # the middle of the contact is half of SINK nearer to the centre than the ball's surface
    assert rolling[0] == pytest.approx(0.5 * 5.0 / 7.0, rel=SINK / RADIUS)
    assert rolling[4] * (RADIUS - 0.5 * SINK) == pytest.approx(rolling[0], rel=1e-4)


def test_a_ball_that_sticks_rocks_on_its_skin_and_comes_to_roll() -> None:
    """Slip answers to k_t and c_t = 2/3 chi N with the mass of a ball that turns, 2/7 m."""
    loop, chi, pushed = fresh("sphere", step=STEP / 16.0, dissipation=4.0), 4.0, 2.0e-3
    loop.reset(
        command(), body_pose=pose([FAR, 0.0, AT_REST]), body_velocity=speeds(pushed, 0, 0, 0, 0, 0)
    )
    mass = 2.0 / 7.0 * MASS
    decay = 2.0 / 3.0 * chi * MASS * GRAVITY / (2.0 * mass)
    swing = np.sqrt(2.0 / 3.0 * STIFFNESS / mass - decay**2)
    slips = []
    for _ in range(12):
        loop.step(command())
        _, velocity = motion(loop)
        slips.append(velocity[0] - (RADIUS - 0.5 * SINK) * velocity[4])
    time = np.arange(1, 13) / RATE
    shape = np.cos(swing * time) - decay / swing * np.sin(swing * time)
    assert slips == pytest.approx(pushed * np.exp(-decay * time) * shape, abs=0.02 * pushed)
    assert abs(slips[-1]) < 0.2 * pushed  # without c_t it would rock for ever


def test_a_ball_rolls_down_a_slope() -> None:
    """With 5/7 g sin(angle), but for how far it sinks in."""
    loop, angle = fresh("sphere", friction=0.8), 0.3
    normal, down = tilt_floor(loop, angle)
    floor = np.array([FAR, 0.0, -0.1])
    loop.bench_numbers("obstacle_position")[:, FLOOR] = torch.tensor(floor)
    loop.reset(command(), body_pose=pose(floor + (RADIUS - SINK * np.cos(angle)) * normal))
    _, velocity = motion(later(loop, 40))
    arm = 1.0 - 0.5 * SINK * np.cos(angle) / RADIUS  # of the contact, in radii
    expected = GRAVITY * np.sin(angle) / (1.0 + 0.4 / arm**2)
    assert velocity[:3] @ down * RATE / 40 == pytest.approx(expected, rel=1e-3)
    assert expected == pytest.approx(5.0 / 7.0 * GRAVITY * np.sin(angle), rel=0.002)


def test_an_elastic_bounce_returns_a_balls_energy() -> None:
    """Three bounces of a ball that loses nothing; steps of 0.03 ms follow each closely."""
    loop = fresh("sphere", step=STEP / 16.0, dissipation=0.0, friction=0.0)
    loop.reset(command(), body_pose=pose([FAR, 0.0, AT_REST + 0.05]))
    stored = []
    for _ in range(150):
        loop.step(command())
        place, velocity = motion(loop)
        height = place[2] - AT_REST
        stored.append(MASS * (GRAVITY * height + 0.5 * velocity[2] ** 2))
    flying = MASS * GRAVITY * 0.05
    assert min(stored) < 0.5 * flying  # what is missing is in the contact
    assert max(stored[-50:]) == pytest.approx(flying, rel=1e-3)


def test_a_finger_pushes_a_ball_as_hard_as_the_ball_pushes_it() -> None:
    """The momentum that a flicked ball gains is what the finger's contact force adds up to."""
    mechanism, fast = scene_of(marble(friction=0.0)), 2000.0  # Hz: a row per step
    loop = ControlLoop(mechanism, ideal_model(), 2, rate=fast, max_step=STEP, device="cpu")
    loop.bench_numbers("body_gravity").zero_()
    loop.reset(command(), body_pose=pose([0.050, 0.002, -0.045]))
    impulse, force = np.zeros(3), np.zeros(3)
    for _ in range(160):
        before = force
        loop.step(command(2.0))
        force = -loop.contact_forces()[0, :, BODY].sum(dim=0).numpy().astype(np.float64)
        impulse += 0.5 / fast * (before + force)
    _, velocity = motion(loop)
    momentum = MASS * velocity[:3]
    assert np.linalg.norm(momentum) > 5e-3  # N s
    # the integrator's two stages are no trapezium rule over the few rows of a contact
    assert impulse == pytest.approx(momentum, abs=0.02 * float(np.linalg.norm(momentum)))


def grip() -> ControlLoop:
    """Let a finger press a ball against the wall, and take the floor away."""
    loop = fresh("sphere", friction=0.8)
    loop.bench_numbers("obstacle_position")[:, WALL, 0] = -0.0045
    loop.bench_numbers("obstacle_position")[:, FLOOR, 2] = -0.037
    loop.reset(command(), body_pose=pose([0.0106, 0.0, -0.022]))
    for step in range(400):
        if step == 200:
            loop.bench_numbers("obstacle_stiffness")[:, FLOOR] = 0.0
        loop.step(command(min(3.0, 0.05 * step)))
    return loop


def test_a_held_ball_is_in_balance() -> None:
    """A finger holds a ball against a wall: forces and weight add up to nothing, and it is still.

    The wall pushes as hard as the ball is deep in it; its friction bears what is left.
    """
    loop = grip()
    place, velocity = motion(loop)
    assert np.max(np.abs(velocity)) < 1e-6
    force = -loop.contact_forces()[0, :, BODY].sum(dim=0).numpy().astype(np.float64)
    weight = np.array([0.0, 0.0, -MASS * GRAVITY])
    push = STIFFNESS * (RADIUS - 0.0045 - place[0])
    assert push > 0.5  # N
    assert force[0] + push == pytest.approx(0.0, abs=1e-3)  # N; 2e-9 m of float32 are 1e-5 N
    borne = np.linalg.norm((force + weight)[1:])
    assert borne < 0.8 * push


def test_a_ball_that_is_not_there_moves_nothing() -> None:
    """Without stiffness the finger moves as one without obstacles."""
    loop = fresh("sphere", stiffness=0.0)
    alone = ControlLoop(
        load_mechanism("finger"), ideal_model(), 2, rate=RATE, max_step=STEP, device="cpu"
    )
    loop.reset(command(), body_pose=pose([0.03, 0.0, -0.02]))
    alone.reset(command())
    for _ in range(20):
        met, free = loop.step(command(2.0)), alone.step(command(2.0))
        # the same equations, solved for eight coordinates in place of two
        assert torch.allclose(met.joint_position, free.joint_position, rtol=0.0, atol=1e-6)


def test_reset_puts_bodies_where_they_are_asked_to_be() -> None:
    """The chosen worlds' alone; where the mechanism has them by default; then all is as anew."""
    loop = fresh("sphere")
    loop.reset(command())
    first = [loop.step(command(1.0)) and motion(loop)[0] for _ in range(20)]
    assert first[-1][2] < 0.1 - 0.04  # m, of a fall of 0.1 s
    other = motion(loop, world=1)[0]
    loop.reset(
        command(),
        torch.tensor([True, False]),
        body_pose=pose([FAR, 0.1, 0.0], np.array([0.0, 0.0, 2.0, 0.0])),
        body_velocity=speeds(1.0, 0.0, 0.0, 0.0, 0.0, 3.0),
    )
    place, velocity = motion(loop)
    assert place == pytest.approx([FAR, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0], abs=1e-7)
    assert velocity == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 3.0])
    assert np.array_equal(motion(loop, world=1)[0], other)
    loop.reset(command())
    again = [loop.step(command(1.0)) and motion(loop)[0] for _ in range(20)]
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))


def test_a_body_that_leaves_the_world_does_no_harm() -> None:
    """Its world is marked, and the body put back; the other world goes on."""
    loop = fresh("sphere")
    loop.reset(command())
    loop.step(command())
    before = motion(loop)[0]
    loop.body_velocity[0, 0] = torch.inf
    reading = loop.step(command())
    assert reading.diverged.tolist() == [True, False]
    assert motion(loop)[0] == pytest.approx(before, abs=1e-6)
    assert np.isfinite(motion(loop, world=1)[1]).all()


def test_hosts_that_move_no_bodies_say_so() -> None:
    """In one line, before anything is compiled."""
    mechanism = scene_of(marble())
    runs = [run_of(np.zeros(4))]
    for host, build in (
        ("Rollout", lambda: simulate(runs, ideal_model(), time_step=STEP, mechanism=mechanism)),
        ("DifferentiableRollout", lambda: DifferentiableRollout(mechanism, runs, ideal_model())),
        ("an MJCF file with a servo", lambda: mujoco_spec(mechanism)),
    ):
        with pytest.raises(InvalidParameter, match=f"^{host} keeps obstacles where they are"):
            build()


def test_what_cannot_move_is_refused() -> None:
    """Masses without a meaning, two bodies at once, and a body's reset where there is none."""
    place, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
    for build, words in (
        (lambda: Sphere(position=place, radius=0.01, mass=0.0), "mass of a sphere"),
        (lambda: Box(position=place, half_size=HALF, mass=np.nan), "finite"),
        (lambda: Plane(position=place, normal=up, mass=1.0), "cannot move"),
        (lambda: build_model(scene_of(marble()).with_obstacles(brick()), 1), "one obstacle"),
    ):
        with pytest.raises(InvalidParameter, match=words):
            build()
    loop = ControlLoop(load_mechanism("finger"), ideal_model(), 2, rate=RATE, device="cpu")
    assert loop.body_pose.shape == (2, 0)
    with pytest.raises(InvalidParameter, match="need an obstacle with a mass"):
        loop.reset(command(), body_pose=pose([0.0, 0.0, 0.0]))


def test_what_tumbles_keeps_momentum_and_energy() -> None:
    """A ball that is heavier on some sides, turned about none of its axes."""
    loop = fresh("sphere")
    inertia = 0.4 * MASS * RADIUS**2 * np.array([0.6, 1.0, 1.5])
    loop.bench_numbers("body_inertia")[:] = torch.tensor(inertia)

    def momentum() -> tuple[Array, float]:
        place, velocity = motion(loop)
        frame = rotation_matrices(place[3:])
        spin = frame @ (inertia * (frame.T @ velocity[3:]))
        return spin, 0.5 * float(spin @ velocity[3:])

    turning = speeds(0.0, 0.0, 0.0, 5.0, 8.0, -3.0)
    loop.reset(command(), body_pose=pose([FAR, 0.0, 5.0]), body_velocity=turning)
    before, energy = momentum()
    later(loop, 100)
    after, left = momentum()
    # five radians; an integrator of second order at 0.5 ms
    assert after == pytest.approx(before, abs=1e-4 * float(np.linalg.norm(before)))
    assert left == pytest.approx(energy, rel=1e-4)


@pytest.mark.slow
def test_a_block_rests_on_four_corners_and_slides_by_its_friction() -> None:
    """Each corner bears a quarter; a push is slowed by mu g; a slope below mu holds it still."""
    loop = fresh("box", friction=0.3)
    height = -0.1 + HALF[2] - SINK / 4.0
    loop.reset(command(), body_pose=pose([FAR, 0.0, height + 0.01]))
    assert motion(later(loop, 150))[0][2] == pytest.approx(height, abs=1e-7)  # float32 at 0.1 m
    rest = motion(loop)[0][:3]
    loop.reset(command(), body_pose=pose(rest), body_velocity=speeds(0.3, 0, 0, 0, 0, 0))
    slow = motion(later(loop, 10))[1][0]
    assert 0.3 - slow == pytest.approx(0.3 * GRAVITY * 10 / RATE, rel=0.01)
    stopped = motion(later(loop, 250))[0]
    assert motion(later(loop, 100))[0] == pytest.approx(
        stopped, abs=1e-6
    )  # it rocked when it stopped


@pytest.mark.slow
def test_a_block_on_a_slope_stays_or_slides() -> None:
    """Below the angle of friction it stays for a second, above it slides by what is left."""
    loop, angle = fresh("box", friction=0.4), 0.3
    loop.bench_numbers("obstacle_friction")[1] = 0.2
    normal, down = tilt_floor(loop, angle)
    floor = np.array([FAR, 0.0, -0.1])
    loop.bench_numbers("obstacle_position")[:, FLOOR] = torch.tensor(floor)
    turn = np.array([0.0, np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)])
    depth = SINK * np.cos(angle) / 4.0
    loop.reset(command(), body_pose=pose(floor + (HALF[2] - depth) * normal, turn))
    _, before = motion(later(loop, 40), world=1)
    _, sliding = motion(later(loop, 40), world=1)
    left = GRAVITY * (np.sin(angle) - 0.2 * np.cos(angle))
    assert (sliding - before)[:3] @ down * RATE / 40 == pytest.approx(left, rel=0.01)
    start = motion(later(loop, 120))[0][:3]
    assert motion(later(loop, 200))[0][:3] == pytest.approx(start, abs=1e-6)  # it rocked at first
