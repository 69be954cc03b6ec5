"""Our solver and those of Newton, each in its fastest mode: a control step as one graph."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverFeatherstone, SolverMuJoCo

from tendon_newton.actuators.networks.history import History, push_sample
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.model_file import Model, NamedValues
from tendon_newton.simulation.tendon_solver import TendonSolver
from tendon_newton.simulation.torch_bridge import Graph

CONTROL_STEP = 0.05
"""One control step of a policy [s]."""
GAIN, RADIUS = 4.2, 0.0125  # N/rad, m
MODEL = Model(
    actuator=NamedValues(name="ideal", values={"gain": GAIN, "spool_radius": RADIUS}), effects=()
)


@lru_cache(maxsize=1)
def fingers(worlds: int, friction: float = 0.0) -> newton.Model:
    """Return so many fingers, with dry friction in their joints [N m].

    Building many takes longer than anything that is measured here.
    """
    model = load_mechanism("finger").build(worlds)
    model.joint_friction.fill_(friction)
    return model


@wp.kernel
def swing_kernel(phase: wp.array(dtype=float), command: wp.array2d(dtype=float)) -> None:
    """Give each finger the next command [rad] of its own swing, 3 s long."""
    i = wp.tid()
    phase[i] = phase[i] + wp.tau / 60.0
    command[i, 0] = 2.2 - 1.8 * wp.cos(phase[i])


class Swing:
    """Commands that keep fingers in motion, each in another part of its swing."""

    def __init__(self, command: wp.array) -> None:
        self.command = command
        self.phase = wp.array(np.linspace(0.0, 2.0e3, len(command), dtype=np.float32))

    def __call__(self) -> None:
        """Go on by a control step."""
        wp.launch(swing_kernel, len(self.phase), inputs=[self.phase, self.command])


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


@wp.kernel
def held_pull_kernel(
    held: wp.array(dtype=float), arms: wp.array(dtype=float), force: wp.array(dtype=float)
) -> None:
    """Apply forces that are held for a control step to the two joints of a finger."""
    i = wp.tid()
    force[2 * i] = arms[2 * i] * held[i]
    force[2 * i + 1] = arms[2 * i + 1] * held[i]


@wp.kernel
def sample_kernel(
    command: wp.array2d(dtype=float), arms: wp.array(dtype=float), q: wp.array(dtype=float),
    v: wp.array(dtype=float), ring: wp.array3d(dtype=float), newest: wp.array(dtype=int),
) -> None:  # fmt: skip
    """Add what a force network is shown to its history."""
    i = wp.tid()
    angle = (arms[2 * i] * q[2 * i] + arms[2 * i + 1] * q[2 * i + 1]) / RADIUS
    rate = (arms[2 * i] * v[2 * i] + arms[2 * i + 1] * v[2 * i + 1]) / RADIUS
    push_sample(ring, newest, i, wp.vec3f(command[i, 0], angle, rate), 0)


class TendonEngine:
    """TendonSolver: one launch per control step."""

    def __init__(
        self, worlds: int, step: float, precision: Any = "float32", *, friction: float = 0.0,
        swings: bool = False,
    ) -> None:  # fmt: skip
        model = fingers(worlds, friction)
        self.solver = TendonSolver(
            model, MODEL, max_step=step, precision=precision, update_bodies=False
        )
        self.command = self.solver.command
        self.swing = Swing(self.command) if swings else None
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
        if self.swing is not None:
            self.swing()
        self.solver.step(self.states[0], self.states[0], None, None, CONTROL_STEP)


class NewtonEngine:
    """One of Newton's solvers: a force kernel and a step per substep."""

    def __init__(
        self, worlds: int, step: float, *, friction: float = 0.0, swings: bool = False
    ) -> None:
        self.model = fingers(worlds, friction)
        self.friction = friction
        self.solver = self.make_solver()
        self.command = wp.zeros((worlds, 1), dtype=float)
        self.swing = Swing(self.command) if swings else None
        self.states = [self.model.state(), self.model.state()]
        self.control = self.model.control()
        self.substeps = 2 * max(
            1, round(CONTROL_STEP / step / 2.0)
        )  # even: the graph ends where it began
        self.step = CONTROL_STEP / self.substeps
        self.control_step()
        with wp.ScopedCapture() as capture:
            self.control_step()
        self.graph = capture.graph

    def make_solver(self) -> Any:
        """Return the solver."""
        raise NotImplementedError

    def settle(self) -> None:
        """Start in the equilibrium of the present command, where our solver finds it."""
        reference = TendonEngine(len(self.command), 5.0e-4, friction=self.friction)
        reference.command.assign(self.command)
        reference.settle()
        self.states[0].assign(reference.states[0])

    def pull(self, state: Any) -> None:
        """Apply the servo's force for one substep."""
        arms = self.model.tendon.arm_coef  # type: ignore[attr-defined]
        inputs = [self.command, arms, state.joint_q, self.control.joint_f]
        wp.launch(pull_kernel, len(self.command), inputs=inputs)

    def control_step(self) -> None:
        """Hold the command for one control step, from state 0 to state 0."""
        if self.swing is not None:
            self.swing()
        for k in range(self.substeps):
            before, after = self.states[k % 2], self.states[1 - k % 2]
            self.pull(before)
            self.solver.step(before, after, self.control, None, self.step)


class MujocoEngine(NewtonEngine):
    """SolverMuJoCo."""

    def make_solver(self) -> Any:
        """Return the solver; nothing touches a finger, and it keeps its warnings to itself."""
        solver = SolverMuJoCo(self.model, disable_contacts=True)
        solver.mjw_model.opt.warn_overflow = 0
        return solver


class FeatherstoneEngine(NewtonEngine):
    """SolverFeatherstone."""

    def make_solver(self) -> Any:
        """Return the solver."""
        return SolverFeatherstone(self.model)


class MujocoNetworkEngine(MujocoEngine):
    """SolverMuJoCo under a force network that is asked once per control step.

    On CUDA, torch's and Warp's launches are one graph; on a CPU the mechanics are.
    """

    def __init__(self, worlds: int, step: float, *, query: ForceQuery, **conditions: Any) -> None:
        device = wp.get_device()
        self.history = History(worlds, query.window, device)
        self.force = wp.zeros(worlds, dtype=float)
        self.query = query
        super().__init__(worlds, step, **conditions)
        self._whole = Graph(self._ask_and_step, device, enabled=device.is_cuda)

    def run(self) -> None:
        """Do one control step."""
        if self.model.device.is_cuda:
            self._whole()
        else:
            self._ask()
            wp.capture_launch(self.graph)

    def pull(self, state: Any) -> None:
        """Apply the force that is held."""
        arms = self.model.tendon.arm_coef  # type: ignore[attr-defined]
        inputs = [self.force, arms, self.control.joint_f]
        wp.launch(held_pull_kernel, len(self.force), inputs=inputs)

    def _ask_and_step(self) -> None:
        self._ask()
        self.control_step()

    def _ask(self) -> None:
        """Show the network the present, and hold what it answers."""
        state, ring = self.states[0], [self.history.ring, self.history.newest]
        arms = self.model.tendon.arm_coef  # type: ignore[attr-defined]
        inputs = [self.command, arms, state.joint_q, state.joint_qd, *ring]
        wp.launch(sample_kernel, len(self.force), inputs=inputs)
        self.query(self.history, self.force)


Engine = TendonEngine | NewtonEngine


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
