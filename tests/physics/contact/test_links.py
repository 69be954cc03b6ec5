"""Links against links: how hard, in balance on both sides, and what is lost."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.bodies import RADIUS, ground, later, marble
from tests.physics.contact.pinches import (
    CROSSED,
    FACING,
    carriages,
    motion_energy,
    pinch,
    press,
    write_pinch,
)
from tests.physics.contact.test_contact import SERVO
from tests.physics.runs import ideal_model

RATE = 400.0  # Hz
STEP = 1.25e-4  # s
PRESSED = (2.0, 1.2)  # rad, commands with which the first finger closes on the second
OPEN = (0.3, 0.5)  # rad, with which they are apart
LEFT_DISTAL, RIGHT_MIDDLE = 1, 2  # Capsules that meet then; the first is the second obstacle
NEAR = (0.25, 0.65, 0.34, 0.55)  # Joint positions just before they touch [rad]
SWINGS = ((6.0, 0.0, 0.0, 0.0), (4.0, 0.0, 4.0, 0.0), (3.0, 3.0, 3.0, 0.0))
"""Joint rates that bring them together from there [rad/s]."""


def loop_of(
    mechanism: Mechanism, *, step: float = STEP, worlds: int = 1, friction: float = 0.0
) -> ControlLoop:
    """Return worlds of a mechanism whose links meet."""
    loop = ControlLoop(mechanism, ideal_model(), worlds, rate=RATE, max_step=step, device="cpu")
    loop.bench_numbers("obstacle_friction").fill_(friction)
    return loop


def command(*angles: float, worlds: int = 1) -> Tensor:
    """Return commands [rad] of both servos, the same in all worlds."""
    return torch.tensor([angles]).repeat(worlds, 1)


def exact(values: Tensor) -> Array:
    """Return the numbers of the first world."""
    return values[0].numpy().astype(np.float64)


@pytest.mark.parametrize(
    ("place", "pressed"),
    [(FACING, PRESSED), pytest.param(CROSSED, (2.0, 0.6), marks=pytest.mark.slow)],
    ids=["in a plane", "in space"],
)
def test_two_links_push_each_other_as_hard(place, pressed, tmp_path) -> None:
    """Each finger is in balance with its springs, its tendon and one force, opposite for both.

    The force is found by hand from where the axes come closest.
    """
    mechanism = pinch(tmp_path, place)
    loop = loop_of(mechanism)
    reading = loop.reset(command(*pressed))
    q, tension = exact(reading.joint_position), exact(reading.force)
    found = exact(loop.contact_forces())
    ((capsule, met),) = np.argwhere(found.any(axis=-1))
    force, torque = press(mechanism, q, int(capsule), int(met))
    assert np.linalg.norm(force) > 0.5  # N
    assert np.min(np.abs(torque[[0, 2]])) > 1e-3  # N m, on both fingers
    arms = np.array([tendon.moment_arm for tendon in mechanism.tendons])
    # float32 of what the loop returns; 1e-7 rad of 60 mm are 3e-5 N, at 50 mm 2e-6 N m
    assert passive_torque(mechanism, q) + tension @ arms == pytest.approx(-torque, abs=5e-6)
    assert found[capsule, met] == pytest.approx(force, abs=1e-4)


@pytest.mark.slow
def test_motors_with_rotors_press_links_in_equilibrium(tmp_path: Path) -> None:
    """Springs, gravity, the tensions that are read and two contacts balance where fingers rest."""
    mechanism = pinch(tmp_path)
    loop = ControlLoop(mechanism, SERVO, 1, rate=RATE, max_step=STEP, device="cpu")
    loop.bench_numbers("obstacle_friction").zero_()
    loop.reset(command(*OPEN))
    for _ in range(1600):
        reading = loop.step(command(*PRESSED))
    q, tension = exact(reading.joint_position), exact(reading.force)
    met = np.argwhere(exact(loop.contact_forces()).any(axis=-1))
    assert len(met) == 2
    torque = sum(press(mechanism, q, int(capsule), int(other))[1] for capsule, other in met)
    assert np.min(np.abs(torque)) > 1e-4  # N m, on all joints
    arms = np.array([tendon.moment_arm for tendon in mechanism.tendons])
    # N m; a millinewton of tension is 8e-6
    assert passive_torque(mechanism, q) + tension @ arms == pytest.approx(-torque, abs=2e-5)


@pytest.mark.slow
def test_links_meet_beside_a_body_that_moves(tmp_path: Path) -> None:
    """A ball that falls on a floor far away changes nothing about fingers that press."""
    mechanism = pinch(tmp_path)
    loops = [loop_of(mechanism), loop_of(mechanism.with_obstacles(marble(), ground(-0.06)))]
    for loop in loops:
        loop.reset(command(*OPEN))
        later(loop, 150, command(*PRESSED))
    places = [loop.reading.joint_position.numpy() for loop in loops]
    assert places[1] == pytest.approx(places[0], abs=1e-6)  # float32
    forces = [exact(loop.contact_forces())[RIGHT_MIDDLE, LEFT_DISTAL] for loop in loops]
    assert np.linalg.norm(forces[0]) > 0.5  # N
    assert forces[1] == pytest.approx(forces[0], abs=1e-4)
    assert loops[1].body_pose[0, 2].item() == pytest.approx(-0.06 + RADIUS, abs=1e-3)


def test_closing_fingers_end_where_they_rest(tmp_path: Path) -> None:
    """What is simulated from open fingers comes to rest in the equilibrium that `reset` finds."""
    loop = loop_of(pinch(tmp_path))
    rest = loop.reset(command(*PRESSED)).joint_position.clone()
    loop.reset(command(*OPEN))
    assert float(loop.contact_forces().abs().max()) == 0.0
    later(loop, 400, command(*PRESSED))
    assert loop.reading.joint_position.numpy() == pytest.approx(rest.numpy(), abs=1e-5)


def test_links_that_run_into_each_other_keep_their_momentum(tmp_path: Path) -> None:
    """Two free carriages: what one loses the other gains, elastic or not, and they part as said."""
    loop = loop_of(carriages(tmp_path), worlds=2, step=STEP / 4.0)
    for name in ("stiffness", "damping"):
        loop.bench_numbers(name).zero_()
    loop.bench_numbers("obstacle_dissipation")[0] = 0.0
    mass = exact(loop.bench_numbers("mass"))
    start = torch.tensor([[0.02, 0.02]]).repeat(2, 1)
    speed = torch.tensor([[0.4, 0.1]]).repeat(2, 1)
    loop.reset(command(0.0, 0.0, worlds=2), joint_position=start, joint_velocity=speed)
    before = mass @ exact(speed)
    later(loop, 40, command(0.0, 0.0, worlds=2))
    after = loop.reading.joint_velocity.numpy().astype(np.float64)
    assert after @ mass == pytest.approx(before, rel=1e-6)  # float32 of what the loop returns
    apart = after[:, 1] - after[:, 0]
    assert apart[0] == pytest.approx(0.3, rel=1e-3)  # m/s, as fast as they came
    assert 0.0 < apart[1] < 0.2


def swing(loop: ControlLoop, speeds: tuple[float, ...], mechanism: Mechanism) -> tuple[Array, bool]:
    """Let two free fingers run into each other; return their energy [J], and whether they met."""
    for name in ("stiffness", "damping", "limit_damping", "gravity"):
        loop.bench_numbers(name).zero_()
    start, rates = (torch.tensor([numbers]) for numbers in (NEAR, speeds))
    reading = loop.reset(command(0.0, 0.0), joint_position=start, joint_velocity=rates)
    stored, met = [], False
    for _ in range(15):
        stored.append(
            motion_energy(mechanism, exact(reading.joint_position), exact(reading.joint_velocity))
        )
        reading = loop.step(command(0.0, 0.0))
        met |= bool(loop.contact_forces().abs().max() > 0.1)
    return np.array(stored), met


@pytest.mark.parametrize("speeds", SWINGS[1:])
def test_an_elastic_meeting_returns_its_energy(speeds: tuple[float, ...], tmp_path: Path) -> None:
    """Without damping or friction two fingers part with the energy that they brought."""
    mechanism = pinch(tmp_path)
    loop = loop_of(mechanism, step=STEP / 8.0)
    loop.bench_numbers("obstacle_dissipation").zero_()
    stored, met = swing(loop, speeds, mechanism)
    assert met
    assert stored[-1] == pytest.approx(stored[0], rel=1e-4)  # 0.016 ms: the step's own error
    assert np.min(stored) < 0.9 * stored[0]  # the rest was in the contact


@pytest.mark.parametrize("speeds", SWINGS)
def test_a_meeting_never_creates_energy(speeds: tuple[float, ...], tmp_path: Path) -> None:
    """With dissipation and friction what is left only shrinks, but for what a contact holds."""
    mechanism = pinch(tmp_path)
    stored, met = swing(loop_of(mechanism, friction=0.5), speeds, mechanism)
    assert met
    later = np.maximum.accumulate(stored[::-1])[::-1]  # the most that comes later
    assert later[0] <= stored[0] * (1.0 + 1e-6)  # float32 of what the loop returns
    assert stored[-1] < 0.5 * stored[0]


def test_pressed_links_stick_and_do_not_creep(tmp_path: Path) -> None:
    """Friction within its cone holds still for a second; without any the links slide on."""
    loop = loop_of(pinch(tmp_path), worlds=2)
    loop.bench_numbers("obstacle_friction")[0] = 0.8
    loop.reset(command(*OPEN, worlds=2))
    later(loop, 400, command(*PRESSED, worlds=2))
    settled = loop.reading.joint_position.clone()
    later(loop, 400, command(*PRESSED, worlds=2))
    moved = (loop.reading.joint_position - settled).abs().max(dim=-1).values
    assert float(moved[0]) < 1e-6  # float32
    assert float((settled[0] - settled[1]).abs().max()) > 0.02  # where they slide without
    force = exact(loop.contact_forces())[RIGHT_MIDDLE, LEFT_DISTAL]
    smooth, _ = press(pinch(tmp_path), exact(loop.reading.joint_position), 2, 1)
    away = smooth / np.linalg.norm(smooth)
    push = float(force @ away)
    drag = float(np.linalg.norm(force - push * away))
    assert 0.1 * push < drag < 0.8 * push


def test_links_that_are_no_obstacles_any_more_pass(tmp_path: Path) -> None:
    """A stiffness of zero takes them out of each other's way: each finger moves as if alone."""
    meeting = loop_of(pinch(tmp_path))
    meeting.bench_numbers("obstacle_stiffness").zero_()
    fingers = load_mechanism(write_pinch(tmp_path))
    alone = ControlLoop(fingers, ideal_model(), 1, rate=RATE, max_step=STEP, device="cpu")
    for loop in (meeting, alone):
        loop.reset(command(*OPEN))
        later(loop, 40, command(*PRESSED))
    places = [loop.reading.joint_position.numpy() for loop in (meeting, alone)]
    assert places[0] == pytest.approx(places[1], abs=1e-6)  # float32
