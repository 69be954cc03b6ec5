"""Our solver and those of Newton, each in its fastest mode: a control step as one graph."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, ClassVar

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverFeatherstone, SolverMuJoCo

from lab.benchmarks.engines_timed.soundness import CONTROL_STEP
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver

GAIN, RADIUS, FORCE_LIMIT = 4.2, 0.0125, 21.0  # N/rad, m, N
MODEL = Model(
    actuator=NamedValues(name="ideal", values={"gain": GAIN, "spool_radius": RADIUS}), effects=()
)
JOINT_FRICTION = 5.0e-3
"""Dry friction of each joint [N m], a tenth of what its spring holds at the end of its range."""
START = 1.0  # Command under which the fingers rest before they swing [rad]
CAPPED = {"iterations": 10, "ls_iterations": 50}
"""MuJoCo's most iterations of its solver and its line search. One iteration is the rule here, and a
graph waits for the slowest world."""
STICKING_FRICTION = (0.9999, 0.99999, 1.0e-4, 0.5, 2.0)
"""MuJoCo's `solimp` of joint friction with which a joint creeps least; its default lets a joint
slide to the end."""
SPRING_STOPS = (0.5, 0.5, 1.0e-3, 0.5, 2.0)
"""MuJoCo's `solimp` of end stops with which they come nearest to the asset's springs; by its
default they are harder, and throw a link off at 2 ms."""


@lru_cache(maxsize=1)
def fingers(worlds: int) -> Any:
    """Return so many fingers. Building many takes longer than anything that is measured here."""
    return build_model(load_mechanism("finger"), worlds)


def rubbing(model: Any, friction: float) -> Any:
    """Return a model of fingers, now with dry friction [N m] and the materials of a comparison."""
    model.joint_friction.fill_(friction)
    count = model.joint_dof_count
    for name, values in (("solimpfriction", STICKING_FRICTION), ("solimplimit", SPRING_STOPS)):
        getattr(model.mujoco, name).assign(np.tile(values, (count, 1)).astype(np.float32))
    return model


@cache
def rest() -> np.ndarray:
    """Return the joints of a finger at rest under the first command [rad], shape (J,)."""
    model = build_model(load_mechanism("finger"), 1)
    solver, state = TendonSolver(model, MODEL, update_bodies=False), model.state()
    solver.command.fill_(START)
    solver.settle(state)
    return state.joint_q.numpy()


@wp.kernel
def swing_kernel(phase: wp.array(dtype=float), command: wp.array2d(dtype=float)) -> None:
    """Give each finger the next command [rad] of its own swing, 3 s long."""
    i = wp.tid()
    phase[i] = phase[i] + wp.tau / 60.0
    command[i, 0] = 2.2 - 1.8 * wp.cos(phase[i])


class Swing:
    """Commands that keep fingers in motion, each in another part of its swing."""

    GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
    """Between neighbours [rad]: however many there are, they are spread evenly."""

    def __init__(self, command: wp.array) -> None:
        self.command = command
        self.phase = wp.zeros(len(command), dtype=float, device=command.device)
        self.begin()

    def begin(self) -> None:
        """Go back to the start."""
        phases = self.GOLDEN_ANGLE * np.arange(len(self.phase)) % (2.0 * np.pi)
        self.phase.assign(phases.astype(np.float32))

    def __call__(self) -> None:
        """Go on by a control step."""
        inputs = [self.phase, self.command]
        wp.launch(swing_kernel, len(self.phase), inputs=inputs, device=self.phase.device)


@wp.kernel
def pull_kernel(
    command: wp.array2d(dtype=float),
    arms: wp.array(dtype=float),
    q: wp.array(dtype=float),
    force: wp.array(dtype=float),
) -> None:
    """Apply the ideal source's force to the two joints of a finger.

    The least that a solver of Newton needs per substep.
    """
    i = wp.tid()
    length = arms[2 * i] * q[2 * i] + arms[2 * i + 1] * q[2 * i + 1]
    pull = wp.clamp(GAIN * (command[i, 0] - length / RADIUS), 0.0, FORCE_LIMIT)
    force[2 * i] = arms[2 * i] * pull
    force[2 * i + 1] = arms[2 * i + 1] * pull


def recorded(work: Callable[[], None]) -> Any:
    """Return launches as a graph; they must have run before."""
    with wp.ScopedCapture() as capture:
        work()
    return capture.graph


def even_substeps(step: float) -> int:
    """Return how many substeps a control step has: even, so that a graph ends where it began."""
    return 2 * max(1, round(CONTROL_STEP / step / 2.0))


class SwingingEngine:
    """Fingers that swing, one graph per control step.

    A class says how to `settle` and to take a `control_step`, and calls `record` when it can.
    """

    command: wp.array  # Motor angles asked for [rad], shape (W, 1)
    has_dry_friction: ClassVar[bool] = True

    def record(self) -> None:
        """Make the graph."""
        self.swing = Swing(self.command)
        self._swing_and_step()
        self.graph = recorded(self._swing_and_step)

    def begin(self) -> None:
        """Put all fingers at rest, and their swings at the start."""
        self.command.fill_(START)
        self.swing.begin()
        self.settle()

    def run(self) -> None:
        """Do one control step."""
        wp.capture_launch(self.graph)

    def settle(self) -> None:
        """Put all fingers at rest."""
        raise NotImplementedError

    def control_step(self) -> None:
        """Hold the command for one control step."""
        raise NotImplementedError

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        raise NotImplementedError

    def _swing_and_step(self) -> None:
        self.swing()
        self.control_step()


class TendonEngine(SwingingEngine):
    """TendonSolver: one launch per control step."""

    def __init__(
        self,
        worlds: int,
        step: float,
        precision: Any = "float32",
        *,
        friction: float = JOINT_FRICTION,
    ) -> None:
        model = rubbing(fingers(worlds), friction)
        self.solver = TendonSolver(
            model, MODEL, max_step=step, precision=precision, update_bodies=False
        )
        self.command = self.solver.command
        self.state: Any = model.state()
        self.record()

    def settle(self) -> None:
        """Put all fingers at rest."""
        self.solver.settle(self.state)

    def control_step(self) -> None:
        """Hold the command for one control step."""
        self.solver.step(self.state, self.state, None, None, CONTROL_STEP)

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        return self.state.joint_q.numpy().reshape(len(self.command), -1)


class NewtonEngine(SwingingEngine):
    """One of Newton's solvers: a force kernel and a step per substep."""

    def __init__(self, worlds: int, step: float, *, friction: float = JOINT_FRICTION) -> None:
        self.model = self.make_model(worlds, friction)
        self.solver = self.make_solver()
        self.control: Any = self.model.control()
        self.command = self.make_command(worlds)
        self.states: list[Any] = [self.model.state(), self.model.state()]
        self.substeps = even_substeps(step)
        self.step = CONTROL_STEP / self.substeps
        self.settle()
        self.record()

    def make_model(self, worlds: int, friction: float) -> Any:
        """Return the fingers."""
        return rubbing(fingers(worlds), friction)

    def make_solver(self) -> Any:
        """Return the solver."""
        raise NotImplementedError

    def make_command(self, worlds: int) -> wp.array:
        """Return where commands are written, shape (W, 1)."""
        return wp.zeros((worlds, 1), dtype=float)

    def settle(self) -> None:
        """Put all fingers at rest."""
        for state in self.states:
            state.joint_q.assign(np.tile(rest(), len(self.command)))
            state.joint_qd.zero_()
            newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)

    def pull(self, state: Any) -> None:
        """Apply the servo's force for one substep."""
        arms = self.model.tendon.arm_coef
        inputs = [self.command, arms, state.joint_q, self.control.joint_f]
        wp.launch(pull_kernel, len(self.command), inputs=inputs)

    def control_step(self) -> None:
        """Hold the command for one control step, from state 0 to state 0."""
        for k in range(self.substeps):
            before, after = self.states[k % 2], self.states[1 - k % 2]
            self.pull(before)
            self.solver.step(before, after, self.control, None, self.step)

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        return self.states[0].joint_q.numpy().reshape(len(self.command), -1)

    def coordinates(self) -> tuple[wp.array, wp.array]:
        """Return where joint angles [rad] and rates [rad/s] are, shape (2 W,)."""
        return self.states[0].joint_q, self.states[0].joint_qd


class MujocoEngine(NewtonEngine):
    """SolverMuJoCo."""

    def make_solver(self) -> Any:
        """Return the solver; nothing touches a finger, and it keeps its warnings to itself."""
        solver = SolverMuJoCo(self.model, disable_contacts=True, **CAPPED)
        solver.mjw_model.opt.warn_overflow = 0
        return solver


class FeatherstoneEngine(NewtonEngine):
    """SolverFeatherstone, which knows no dry friction."""

    has_dry_friction: ClassVar[bool] = False

    def make_solver(self) -> Any:
        """Return the solver."""
        return SolverFeatherstone(self.model)
