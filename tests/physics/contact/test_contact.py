"""Links against obstacles: how deep, how hard, and what is lost."""

from functools import cache

import numpy as np
import pytest
import torch
from scipy.optimize import root
from torch import Tensor

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset, InvalidParameter
from tendon_newton.mechanisms.geometry.obstacles import Box, Plane, Sphere
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.made import stated_model
from tests.physics.contact.bodies import ball, ball_torque, block, floor, later
from tests.physics.runs import DATA_SHEET, GAIN, RADIUS, ideal_model
from tests.physics.test_closed_form import energy

ARMS = np.array([0.0080, 0.0055])  # m
SCENE = (ball(), block(), floor())
BALL, BLOCK, FLOOR = range(3)
RATE = 200.0  # Hz
STEP = 1.25e-4  # s
CLOSED = 3.0  # rad, a command that presses
SERVO = stated_model("pwm_servo", DATA_SHEET)


@cache
def scene(step: float) -> ControlLoop:
    """Return worlds with a ball, a block and a floor, of which a test chooses."""
    mechanism = load_mechanism("finger").with_obstacles(*SCENE)
    return ControlLoop(mechanism, ideal_model(), 4, rate=RATE, max_step=step, device="cpu")


def prepare(
    *present: int, friction: float = 0.0, dissipation: float = 10.0, step: float = STEP
) -> ControlLoop:
    """Return the scene with some obstacles in all worlds, its other numbers nominal."""
    loop = scene(step)
    loop.solver.notify_model_changed(1)
    for name, value in (("friction", friction), ("dissipation", dissipation)):
        loop.bench_numbers(f"obstacle_{name}").fill_(value)
    stiffness = loop.bench_numbers("obstacle_stiffness")
    for number in set(range(len(SCENE))) - set(present):
        stiffness[:, number] = 0.0
    return loop


def command(angle: float) -> Tensor:
    """Return one command [rad] for all worlds."""
    return torch.full((4, 1), angle)


def test_a_held_ball_is_squeezed_as_hard_as_statics_say() -> None:
    """Springs, gravity, tendon and contact balance, solved apart from the simulator."""
    loop = prepare(BALL)
    reading = loop.reset(command(CLOSED))
    mechanism, sphere = load_mechanism("finger"), ball()

    def residual(q: Array) -> Array:
        tension = max(0.0, GAIN * (CLOSED - ARMS @ q / RADIUS))
        return passive_torque(mechanism, q) + ARMS * tension + ball_torque(mechanism, sphere, q)[0]

    start = reading.joint_position[0].numpy().astype(np.float64)
    solution = root(residual, start + 0.02, tol=1e-12)
    assert solution.success
    _, push = ball_torque(mechanism, sphere, solution.x)
    assert np.min(push) > 0.5  # N: both phalanges hold the ball
    # float32 of what the loop returns; a micrometre of depth is 5 mN
    assert start == pytest.approx(solution.x, abs=1e-6)
    found = torch.linalg.vector_norm(loop.contact_forces()[0, :, BALL], dim=-1).numpy()
    assert found == pytest.approx(push, rel=1e-3)


def test_a_motor_with_a_rotor_holds_a_ball_in_equilibrium() -> None:
    """Springs, gravity, the tension that is read and the ball balance where the finger rests."""
    mechanism, sphere = load_mechanism("finger"), ball()
    loop = ControlLoop(
        mechanism.with_obstacles(sphere), SERVO, 1, rate=RATE, max_step=STEP, device="cpu"
    )
    loop.bench_numbers("obstacle_friction").fill_(0.0)
    loop.reset(torch.zeros(1, 1))
    for _ in range(400):
        reading = loop.step(torch.full((1, 1), CLOSED))
    angles = reading.joint_position[0].numpy().astype(np.float64)
    squeeze, push = ball_torque(mechanism, sphere, angles)
    tension = float(reading.force[0, 0])
    assert np.min(push) > 0.1  # N
    assert squeeze + passive_torque(mechanism, angles) == pytest.approx(
        -ARMS * tension, abs=1e-5
    )  # N m; a millinewton of tension is 8e-6


def test_closing_on_a_ball_ends_where_it_rests() -> None:
    """What is simulated from an open finger comes to rest in the equilibrium that `reset` finds."""
    loop = prepare(BALL)
    rest = loop.reset(command(CLOSED)).joint_position[0].clone()
    loop.reset(command(0.0))
    later(loop, 200, command(CLOSED))
    assert loop.reading.joint_position[0].numpy() == pytest.approx(rest.numpy(), abs=1e-5)


def test_an_obstacle_that_is_not_there_changes_nothing() -> None:
    """With a stiffness of zero the motion is that without obstacles, to the last bit."""
    loops = [
        prepare(),
        ControlLoop(
            load_mechanism("finger"), ideal_model(), 4, rate=RATE, max_step=STEP, device="cpu"
        ),
    ]
    tracks = []
    for loop in loops:
        loop.reset(command(0.5))
        tracks.append([loop.step(command(CLOSED)).joint_position.clone() for _ in range(20)])
    assert all(torch.equal(a, b) for a, b in zip(*tracks, strict=True))
    assert loops[1].contact_forces().numel() == 0


def swing(loop: ControlLoop, steps: int) -> Array:
    """Let a closed finger open onto what is above it, and return its energy [J], (steps,)."""
    for name in ("damping", "limit_damping"):
        loop.bench_numbers(name).zero_()
    loop.bench_numbers("obstacle_position")[:, FLOOR, 2] = -0.010
    # upside down: the floor becomes a ceiling
    loop.bench_numbers("obstacle_rotation")[:, FLOOR] = torch.diag(
        torch.tensor([1.0, -1.0, -1.0], dtype=torch.float64)
    )
    loop.reset(command(0.0), joint_position=torch.tensor([[1.2, 0.6]]).repeat(4, 1))
    stored = []
    for _ in range(steps):
        reading = loop.step(command(0.0))
        q = reading.joint_position[0].numpy().astype(np.float64)
        v = reading.joint_velocity[0].numpy().astype(np.float64)
        stored.append(energy(q, v))
    return np.array(stored)


def test_an_elastic_bounce_returns_its_energy() -> None:
    """Without damping or friction a bounce keeps the energy of springs, gravity and motion."""
    stored = swing(prepare(FLOOR, dissipation=0.0, step=STEP / 4.0), 240)
    start = stored[0]
    # a scheme that damps what is too fast for it takes 0.1 % of each bounce at 0.03 ms
    assert stored[-40:].max() == pytest.approx(start, rel=0.01)
    assert stored[-40:].max() < start * (1.0 + 1e-5)  # float32 of what the loop returns
    assert np.min(stored) < 0.9 * start  # the rest was in the contact


def test_a_bounce_never_creates_energy() -> None:
    """With dissipation and friction what is left only shrinks."""
    stored = swing(prepare(FLOOR, dissipation=10.0, friction=0.5), 100)
    free = np.maximum.accumulate(stored[::-1])[::-1]  # the most that comes later
    assert np.all(np.diff(free) <= 1e-9)
    assert free[0] <= stored[0] * (1.0 + 1e-5)  # float32 of what the loop returns
    assert stored[-1] < 0.5 * stored[0]


def test_a_pressed_finger_sticks_and_does_not_creep() -> None:
    """Friction within its cone holds still for a second; without any the finger slides off."""
    loop = prepare(FLOOR, friction=0.8)
    loop.bench_numbers("obstacle_friction")[1:] = 0.0
    loop.reset(command(0.0))
    later(loop, 100, command(CLOSED))
    settled = loop.reading.joint_position.clone()
    later(loop, 200, command(CLOSED))
    moved = (loop.reading.joint_position - settled).abs().max(dim=-1).values
    assert float(moved[0]) < 1e-6  # float32
    assert float((settled[0] - settled[1]).abs().max()) > 0.1  # where it slides without
    normal, drag = split_force(loop, world=0)
    assert 0.1 * normal < drag < 0.8 * normal


def test_a_sliding_contact_drags_with_its_coefficient() -> None:
    """While the tip slides along the floor, Coulomb's share of the normal force holds it back."""
    loop = prepare(FLOOR, friction=0.1)
    loop.reset(command(1.0))
    for k in range(40):
        loop.step(command(1.0 + 0.05 * k))
    normal, drag = split_force(loop, world=0)
    assert normal > 0.2  # N
    assert drag == pytest.approx(0.1 * normal, rel=1e-3)


def split_force(loop: ControlLoop, *, world: int) -> tuple[float, float]:
    """Return the floor's push across and along itself [N]."""
    force = loop.contact_forces()[world, :, FLOOR].sum(dim=0).numpy().astype(np.float64)
    normal = loop.bench_numbers("obstacle_rotation")[world, FLOOR, :, 2].numpy()
    push = float(force @ normal)
    return push, float(np.linalg.norm(force - push * normal))


def test_what_cannot_be_an_obstacle_is_refused() -> None:
    """Numbers without a meaning, and benches whose links have nothing to touch with."""
    for build, words in (
        (lambda: Sphere(position=np.zeros(3), radius=0.0), "radius of a sphere"),
        (lambda: Sphere(position=np.zeros(2), radius=0.1), "3 components"),
        (lambda: Plane(position=np.zeros(3), normal=np.zeros(3)), "direction"),
        (lambda: Box(position=np.zeros(3), half_size=np.array([1.0, -1.0, 1.0])), "half_size"),
        (lambda: ball(friction=-0.1), "friction of a sphere"),
        (lambda: ball(stiffness=np.nan), "finite"),
        (lambda: Box(position=np.zeros(3), half_size=np.ones(3), turn=2.0 * np.eye(3)), "rotation"),
    ):
        with pytest.raises(InvalidParameter, match=words):
            build()
    with pytest.raises(InvalidAsset, match="capsules"):
        build_model(load_mechanism("spring_weak").with_obstacles(ball()), 1, device="cpu")
