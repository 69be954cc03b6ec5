"""Every asset under any command: it settles in equilibrium, and it stays a mechanism."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp

from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import LONGEST_STEP, TendonSolver
from tests.conftest import SEED
from tests.physics.runs import GAIN, RADIUS, ideal_model

WORLDS = 96
GREATEST = 8.0  # rad, beyond what a policy may ask for: the servo's limit is reached at 5 rad
BALANCED = 1.0e-6  # N m
FASTEST = 600.0  # rad/s: the pendulum, undamped, turns as fast
BEYOND = 0.1  # rad: what a blow of 20 N presses into a stop of 30 N m/rad, and more
HOLD = 0.05  # s
COARSE = 2.0e-3  # s
KINEMATIC = ("servo",)
every_asset = pytest.mark.parametrize("name", [n for n in asset_names() if n not in KINEMATIC])


def alone(name: str) -> Mechanism:
    """Return an asset's mechanism without what it holds: statics know of no contact."""
    return replace(load_mechanism(name), obstacles=())


def rounded(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose ranges are float32, as Newton's model has them.

    An end stop of 30 N m/rad makes 1e-6 N m of the difference.
    """
    joints = tuple(
        replace(joint, limits=(float(np.float32(low)), float(np.float32(high))))
        for joint in mechanism.joints
        for low, high in [joint.limits]
    )
    return replace(mechanism, joints=joints)


def imbalance(mechanism: Mechanism, q: np.ndarray, command: np.ndarray) -> float:
    """Return the greatest torque that nothing balances [N m], from numpy's own lengths and arms."""
    torque = passive_torque(mechanism, q)
    for tendon, angle in zip(mechanism.tendons, command.astype(np.float64), strict=True):
        radius = 1.0 if tendon.direct else float(np.float32(RADIUS))
        pull = GAIN * (angle - excursion(tendon, q) / radius)
        least = -tendon.force_limit if tendon.direct else 0.0
        pull = np.clip(pull, least, tendon.force_limit)
        torque = torque + moment_arms(tendon, q) * pull
    return float(np.max(np.abs(torque)))


def joints_of(solver: TendonSolver) -> np.ndarray:
    """Return the joint positions with all their digits, shape (W, J): Newton's are float32."""
    return solver._servo.q.numpy().reshape(solver.world_count, -1)


def worlds_of(mechanism: Mechanism, step: float) -> tuple[TendonSolver, Any, np.ndarray]:
    """Return worlds that settled under random commands, their state, and the commands (W, D)."""
    model = build_model(mechanism, WORLDS, device="cpu")
    solver = TendonSolver(model, ideal_model(), max_step=step, update_bodies=False)
    state: Any = model.state()
    rng = np.random.default_rng(SEED)
    commands = rng.uniform(0.0, GREATEST, (WORLDS, solver.tendon_count)).astype(np.float32)
    solver.command.assign(commands)
    solver.settle(state)
    return solver, state, commands


@every_asset
def test_it_settles_in_equilibrium_under_any_command(name: str) -> None:
    """Forces balance to 1e-6 N m; held for a quarter of a second, it stays to 1e-9 rad."""
    mechanism = alone(name)
    solver, state, commands = worlds_of(mechanism, COARSE)
    settled = joints_of(solver)
    judge = rounded(mechanism)
    found = [imbalance(judge, q, angle) for q, angle in zip(settled, commands, strict=True)]
    assert max(found) < BALANCED
    for _ in range(5):
        solver.step(state, state, None, None, HOLD)
    assert joints_of(solver) == pytest.approx(settled, abs=1e-9)  # it stands stably


@every_asset
@pytest.mark.parametrize("step", [COARSE, LONGEST_STEP])
def test_no_command_makes_it_diverge(name: str, step: float) -> None:
    """Jumps over the whole range every 50 ms, closed or slack: within its stops, at a real speed.

    At 2 ms a finger's lightest link moves by half a radian in a step, through two stops at once.
    """
    mechanism = alone(name)
    solver, state, _ = worlds_of(mechanism, step)
    rng = np.random.default_rng(SEED + 1)
    diverged = wp.zeros(WORLDS, dtype=wp.bool, device="cpu")
    lower, upper = np.array(mechanism.joint_limits).T
    for _ in range(12):
        commands = rng.uniform(0.0, GREATEST, (WORLDS, solver.tendon_count))
        solver.command.assign(commands.astype(np.float32))
        solver.step(state, state, None, None, HOLD)
        solver.guard(state, diverged)
        q = joints_of(solver)
        assert np.all((q > lower - BEYOND) & (q < upper + BEYOND))
        assert np.max(np.abs(state.joint_qd.numpy())) < FASTEST
    assert not diverged.numpy().any()
