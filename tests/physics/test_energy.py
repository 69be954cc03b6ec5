"""Energy: what the tendon does is stored or lost, and nothing else."""

import newton
import numpy as np
import pytest

from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.simulation.tendon_solver import TendonSolver
from tests.physics.runs import ideal_model

STEP = 2.5e-4  # s
COUNT = 6000
FRICTION = np.array([1.0e-3, 5.0e-4])  # N m


def test_tendon_work_is_energy_gained_plus_heat() -> None:
    """Work of the tension at the load cell = change of energy + damping + joint friction.

    Along a smooth command.
    """
    model = load_mechanism("finger").build(1, device="cpu")
    model.joint_friction.assign(FRICTION.astype(np.float32))
    solver = TendonSolver(
        model,
        ideal_model(coulomb_friction={"force": 0.3}, viscous_friction={"coefficient": 0.2}),
        max_step=STEP,
        update_bodies=False,
    )
    time = STEP * np.arange(COUNT)
    command = 1.6 - 0.8 * np.cos(2.0 * np.pi * time)
    q, v, power = follow(solver, model, command)
    work = np.sum(power.mean(axis=1)) * STEP
    damping = np.trapezoid(v**2 @ [5e-4, 3e-4], dx=STEP)
    friction = np.trapezoid(np.abs(v) @ FRICTION, dx=STEP)
    stored = energy(q[-1], v[-1]) - energy(q[0], v[0])
    assert damping > 0.01 * work
    assert friction > 0.01 * work
    # 1e-4: trapezium rule over the reversals of friction, float32 of Newton's state
    assert work == pytest.approx(stored + damping + friction, rel=1e-4)


def follow(
    solver: TendonSolver, model: newton.Model, command: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Step along a command [rad]; return joints, and the tendon's power [W] at each step's ends.

    The command holds still within a step, so the tension at its end is not that at the start of
    the next.
    """
    state, after = model.state(), model.state()
    solver.command.fill_(command[0])
    solver.settle(state)
    q, v, power = np.zeros((COUNT + 1, 2)), np.zeros((COUNT + 1, 2)), np.zeros((COUNT, 2))
    for k, value in enumerate(command):
        solver.command.fill_(value)
        for end in (0, 1):
            solver.read_sensors(state)
            q[k + end], v[k + end] = state.joint_q.numpy(), state.joint_qd.numpy()
            power[k, end] = solver.force.numpy()[0, 0] * (v[k + end] @ [0.0080, 0.0055])
            if end == 0:
                solver.step(state, after, None, None, STEP)
                state, after = after, state
    return q, v, power


def energy(q: np.ndarray, v: np.ndarray) -> float:
    """Return kinetic energy, springs and gravity of the nominal finger [J], by hand."""
    a, b = q[0], q[0] + q[1]
    u, w = v[0], v[0] + v[1]
    middle = 0.5 * (0.012 * 0.015**2 + 0.012 * 0.030**2 / 12.0) * u**2
    speed = (0.030 * u) ** 2 + (0.0125 * w) ** 2 + 2.0 * 0.030 * 0.0125 * u * w * np.cos(q[1])
    distal = 0.5 * 0.008 * speed + 0.5 * (0.008 * 0.025**2 / 12.0) * w**2
    springs = 0.5 * 0.045 * q[0] ** 2 + 0.5 * 0.030 * q[1] ** 2
    height = 0.012 * 0.015 * np.sin(a) + 0.008 * (0.030 * np.sin(a) + 0.0125 * np.sin(b))
    return float(middle + distal + springs - 9.81 * height)
