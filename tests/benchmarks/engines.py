"""Our solver and SolverMuJoCo, each in its fastest mode.

A control step of many fingers as one graph.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.model_file import Model, NamedValues
from tendon_newton.simulation.tendon_solver import TendonSolver

CONTROL_STEP = 0.05
"""One control step of a policy [s]."""
GAIN, RADIUS = 4.2, 0.0125  # N/rad, m
MODEL = Model(
    actuator=NamedValues(name="ideal", values={"gain": GAIN, "spool_radius": RADIUS}), effects=()
)


@wp.kernel
def pull_kernel(
    command: wp.array2d(dtype=float),
    arms: wp.array(dtype=float),
    q: wp.array(dtype=float),
    force: wp.array(dtype=float),
) -> None:
    """Apply the ideal source's force to the two joints of a finger.

    The least that SolverMuJoCo needs per substep.
    """
    i = wp.tid()
    length = arms[2 * i] * q[2 * i] + arms[2 * i + 1] * q[2 * i + 1]
    pull = wp.clamp(GAIN * (command[i, 0] - length / RADIUS), 0.0, 21.0)
    force[2 * i] = arms[2 * i] * pull
    force[2 * i + 1] = arms[2 * i + 1] * pull


class TendonEngine:
    """TendonSolver: one launch per control step."""

    def __init__(self, worlds: int, step: float, precision: Any = "float32") -> None:
        model = load_mechanism("finger").build(worlds)
        self.solver = TendonSolver(
            model, MODEL, max_step=step, precision=precision, update_bodies=False
        )
        self.command = self.solver.command
        self.states = [model.state(), model.state()]
        self.control_step()
        with wp.ScopedCapture() as capture:
            self.control_step()
        self.graph = capture.graph

    def settle(self) -> None:
        """Start in the equilibrium of the present command."""
        self.solver.settle(self.states[0])

    def control_step(self) -> None:
        """Hold the command for one control step, from state 0 to state 0."""
        self.solver.step(self.states[0], self.states[0], None, None, CONTROL_STEP)


class MujocoEngine:
    """SolverMuJoCo: a force kernel and a step per substep."""

    def __init__(self, worlds: int, step: float) -> None:
        self.model = load_mechanism("finger").build(worlds)
        self.solver = SolverMuJoCo(self.model, disable_contacts=True)
        self.command = wp.zeros((worlds, 1), dtype=float)
        self.states = [self.model.state(), self.model.state()]
        self.control = self.model.control()
        self.substeps = 2 * max(
            1, round(CONTROL_STEP / step / 2.0)
        )  # even: the graph ends where it began
        self.step = CONTROL_STEP / self.substeps
        self.reference = TendonEngine(worlds, 5.0e-4)
        self.control_step()
        with wp.ScopedCapture() as capture:
            self.control_step()
        self.graph = capture.graph

    def settle(self) -> None:
        """Start in the equilibrium of the present command, where our solver finds it."""
        self.reference.command.assign(self.command)
        self.reference.settle()
        self.states[0].assign(self.reference.states[0])

    def control_step(self) -> None:
        """Hold the command for one control step, from state 0 to state 0."""
        arms = self.model.tendon.arm_coef  # type: ignore[attr-defined]
        for k in range(self.substeps):
            before, after = self.states[k % 2], self.states[1 - k % 2]
            inputs = [self.command, arms, before.joint_q, self.control.joint_f]
            wp.launch(pull_kernel, len(self.command), inputs=inputs)
            self.solver.step(before, after, self.control, None, self.step)


Engine = TendonEngine | MujocoEngine


def follow(engine: Engine, commands: np.ndarray) -> np.ndarray:
    """Return world 0's joints after each control step of a run of commands [rad]."""
    engine.command.fill_(float(commands[0]))
    engine.settle()
    out = []
    for value in commands:
        engine.command.fill_(float(value))
        wp.capture_launch(engine.graph)
        out.append(engine.states[0].joint_q.numpy()[:2].copy())
    return np.array(out)


def rate(run: Callable[[], None], worlds: int, seconds: float = 1.0) -> float:
    """Return control steps per second, the best of five spans of time, warm."""
    run()
    start = time.perf_counter()
    run()
    once = time.perf_counter() - start
    count = max(1, int(seconds / 5.0 / max(once, 1e-7)))
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(count):
            run()
        wp.synchronize()
        best = min(best, (time.perf_counter() - start) / count)
    return worlds / best
