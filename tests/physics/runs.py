"""Short runs for the tests of physics."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import newton
import numpy as np
import warp as wp

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Rollout, Stepping, Trajectory
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.made import recorded, stated_model

GAIN = 4.2  # N/rad
RADIUS = 0.0125  # m
ROWS = 80.0  # Hz
QUASI_STATIC = BenchOverrides(mass=(1.0e-9,), damping=(0.0,))  # Only springs and loads show
DATA_SHEET = {
    "duty_per_rad": 0.10, "max_duty": 0.90, "supply_voltage": 9.0, "torque_constant": 1.43,
    "resistance": 15.0, "armature": 0.0025, "spool_radius": RADIUS,
}  # fmt: skip
"""A servo whose host closes the position loop: the row of 9.0 V in a data sheet."""

ASLEEP = {
    "gain_error": {"scale": 1.0},
    "viscous_friction": {"coefficient": 0.0},
    "coulomb_friction": {"force": 0.0},
    "joint_stiffness_error": {"scale": 1.0},
}
"""Effects that are switched off: tests that wake one of them, or none, share their kernels."""

DELAYED = {
    "command_delay": {"delay": 0.031},
    "viscous_friction": {"coefficient": 0.0},
    "coulomb_friction": {"force": 0.7},
}
"""A servo that acts late and sticks: the same wherever a finger is stepped."""


def ideal_model(**effects: dict[str, float]) -> Model:
    """Return the nominal actuator with some effects."""
    return stated_model("ideal", {"gain": GAIN, "spool_radius": RADIUS}, effects)


def run_of(
    command: Sequence[float] | Array,
    *,
    bench: str = "finger",
    rate: float = ROWS,
    start: Literal["equilibrium", "first_row"] = "equilibrium",
    angle: float = 0.0,
    speed: float = 0.0,
    **more: Any,
) -> Recording:
    """Return a recording that holds commands [rad], one per row and tendon."""
    commands = np.asarray(command, dtype=np.float64)
    commands = commands.reshape(len(commands), -1)
    count, tendons = commands.shape
    return recorded(
        np.arange(count) / rate,
        np.full((count, tendons), angle),
        name="run",
        bench=bench,
        command=commands,
        motor_velocity=np.full((count, tendons), speed),
        start=start,
        **more,
    )


def led(path: Array, load: Array, *, bench: str = "spring_weak", rate: float = ROWS) -> Recording:
    """Return a recording of a shaft led along a path [rad] under loads [N], a row each."""
    blank = np.zeros(len(path))
    return recorded(
        np.arange(len(path)) / rate,
        path,
        name="led",
        bench=bench,
        motor_velocity=blank,
        force=blank,
        joint_position=blank,
        joint_load=load,
        bench_overrides=QUASI_STATIC,
    )


def stairs(rng: np.random.Generator, rows: int, lower: float, upper: float, hold: int) -> Array:
    """Return random commands [rad], each held for some rows."""
    return np.repeat(rng.uniform(lower, upper, rows // hold + 1), hold)[:rows]


def simulate(
    recordings: Sequence[Recording],
    model: Model,
    *,
    time_step: float,
    mechanism: Mechanism | None = None,
    joint_friction: Sequence[float] | None = None,
) -> list[Trajectory]:
    """Run one bench's recordings with our solver."""
    rollout = Rollout(
        mechanism or load_mechanism(recordings[0].bench),
        recordings,
        model,
        stepping=Stepping(time_step=time_step),
        device="cpu",
    )
    if joint_friction is not None:
        rollout.numbers.friction.assign(np.tile(joint_friction, (len(recordings), 1)))
    return rollout.run(rollout.base_vectors(model)[None])[0]


def follow(
    solver: TendonSolver, model: newton.Model, command: Array, step: float
) -> tuple[Array, Array, Array]:
    """Step along a command [rad]; return joints, and the tendon's power [W] at each step's ends.

    The command holds still within a step, so the tension at its end is not that at the start of
    the next.
    """
    count = len(command)
    state, after = model.state(), model.state()
    solver.command.fill_(float(command[0]))
    solver.settle(state)
    q, v = (np.zeros((count + 1, model.joint_dof_count)) for _ in range(2))
    power = np.zeros((count, 2))
    for k, value in enumerate(command):
        solver.command.fill_(float(value))
        for end in (0, 1):
            solver.read_sensors(state)
            q[k + end], v[k + end] = state.joint_q.numpy(), state.joint_qd.numpy()
            speed = RADIUS * solver.motor_velocity.numpy()[0, 0]
            power[k, end] = solver.force.numpy()[0, 0] * speed
            if end == 0:
                solver.step(state, after, None, None, step)
                state, after = after, state
    return q, v, power


def replayed(step: Callable[[], None]) -> Callable[[], None]:
    """Return a step that Python launches once; from then on a graph on the CPU does the same."""
    graphs: list[Any] = []

    def again() -> None:
        if graphs:
            wp.capture_launch(graphs[0])
            return
        step()  # compiles and allocates before the capture
        with wp.ScopedCapture(device="cpu") as capture:
            step()  # recorded, not done
        graphs.append(capture.graph)

    return again


def held_run(model: Model, bench: str) -> Recording:
    """Return a log of a model that begins amid a rest, short of its friction-free equilibrium.

    Its encoder counts microradians: what rests reads the same.
    """
    command = np.repeat([0.1, 0.4, 1.2, 0.7], [80, 120, 80, 80])
    (whole,) = replay([run_of(command, bench=bench)], model)
    cut = slice(150, None)
    return replace(
        run_of(command[cut], bench=bench),
        motor_position=np.round(whole.motor_position[cut], 6),
        motor_velocity=whole.motor_velocity[cut],
    )
