"""Energy: what the tendon does is stored or lost, and nothing else."""

import numpy as np
import pytest

from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.physics.runs import follow, ideal_model

STEP = 2.5e-4  # s
FRICTION = np.array([1.0e-3, 5.0e-4])  # N m


def test_tendon_work_is_energy_gained_plus_heat() -> None:
    """Work of the tension at the load cell = change of energy + damping + joint friction.

    Along a smooth command.
    """
    model = build_model(load_mechanism("finger"), 1, device="cpu")
    model.joint_friction.assign(FRICTION.astype(np.float32))
    solver = TendonSolver(
        model,
        ideal_model(coulomb_friction={"force": 0.3}, viscous_friction={"coefficient": 0.2}),
        max_step=STEP,
        update_bodies=False,
    )
    time = STEP * np.arange(6000)
    command = 1.6 - 0.8 * np.cos(2.0 * np.pi * time)
    q, v, power = follow(solver, model, command, STEP)
    work = np.sum(power.mean(axis=1)) * STEP
    damping = np.trapezoid(v**2 @ [5e-4, 3e-4], dx=STEP)
    friction = np.trapezoid(np.abs(v) @ FRICTION, dx=STEP)
    stored = energy(q[-1], v[-1]) - energy(q[0], v[0])
    assert damping > 0.01 * work
    assert friction > 0.01 * work
    # 1e-4: trapezium rule over the reversals of friction, float32 of Newton's state
    assert work == pytest.approx(stored + damping + friction, rel=1e-4)


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
