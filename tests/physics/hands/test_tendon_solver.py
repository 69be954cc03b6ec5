"""Our solver behind Newton's interface."""

from typing import Any

import newton
import numpy as np
import pytest
import warp as wp

from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.physics.runs import DELAYED, ROWS, ideal_model, run_of, simulate, stairs

PERIOD = 1.0 / ROWS
MODEL = ideal_model(**DELAYED)


def make_solver(worlds: int, **options: Any) -> tuple[TendonSolver, newton.Model]:
    """Return a solver of some fingers with friction and a delay, and their Newton model."""
    model = build_model(load_mechanism("finger"), worlds, device="cpu")
    return TendonSolver(model, MODEL, update_bodies=False, **options), model


def follow(solver: TendonSolver, model: newton.Model, command: np.ndarray) -> np.ndarray:
    """Step from equilibrium.

    Return joints, angle and force of the last world just after each command.
    """
    state, after = model.state(), model.state()
    solver.command.fill_(command[0])
    solver.settle(state)
    rows = []
    for value in command:
        solver.command.fill_(value)
        solver.read_sensors(state)
        rows.append(
            [
                *state.joint_q.numpy()[-2:],
                solver.motor_position.numpy()[-1, 0],
                solver.force.numpy()[-1, 0],
            ]
        )
        solver.step(state, after, None, None, PERIOD)
        state, after = after, state
    return np.array(rows)


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-6), ("float32", 1e-4)])
def test_control_steps_are_the_rollout(precision, tolerance, rng) -> None:
    """Row by row the solver is the rollout, but for rounding to float32, Newton's or its own."""
    command = stairs(rng, 101, 0.5, 3.0, 20)
    (run,) = simulate([run_of(command)], MODEL, time_step=5e-4)
    solver, model = make_solver(2, precision=precision)
    rows = follow(solver, model, command)
    assert rows[:, :2] == pytest.approx(run.joint_position, abs=tolerance)
    assert rows[:, 2] == pytest.approx(run.motor_position[:, 0], abs=tolerance)
    assert rows[:, 3] == pytest.approx(run.force[:, 0], abs=10.0 * tolerance)  # gain 4.2 N/rad


def test_a_graph_replays_the_step() -> None:
    """Nothing in a step is allocated or read back: captured, it does the same."""
    command = np.full(20, 2.0)
    solver, model = make_solver(3)
    expected = follow(solver, model, command)[-1, :2]
    state, after = model.state(), model.state()
    solver.command.fill_(2.0)
    solver.settle(state)
    with wp.ScopedCapture(device="cpu") as capture:
        solver.step(state, after, None, None, PERIOD)
        solver.step(after, state, None, None, PERIOD)
    for _ in range(10):
        wp.capture_launch(capture.graph)
    assert state.joint_q.numpy()[-2:] == pytest.approx(expected, abs=1e-6)


def test_changed_numbers_count_in_their_own_world() -> None:
    """A stiffer spring of the model and a stronger friction reach one world each."""
    solver, model = make_solver(3)
    stiffness = model.joint_stiffness.numpy()
    stiffness[2:4] *= 2.0
    model.joint_stiffness.assign(stiffness)
    solver.notify_model_changed(newton.ModelFlags.JOINT_DOF_FORCE_PROPERTIES)
    parameters = solver.parameters.numpy()
    parameters[2, solver.table.column("coulomb_friction", "force")] = 3.0
    solver.parameters.assign(parameters)
    state, after = model.state(), model.state()
    solver.command.fill_(0.5)
    solver.settle(state)
    solver.command.fill_(2.5)
    for _ in range(60):
        solver.step(state, after, None, None, PERIOD)
        state, after = after, state
    closed = state.joint_q.numpy().reshape(3, 2).sum(axis=1)
    assert closed[1] < 0.95 * closed[0]
    assert closed[2] < 0.95 * closed[0]


def test_reset_forgets_only_in_the_chosen_worlds() -> None:
    """A world that begins anew no longer waits for the delayed command."""
    solver, model = make_solver(2)
    state, after = model.state(), model.state()
    solver.command.fill_(0.5)
    solver.settle(state)
    solver.command.fill_(2.5)
    solver.reset(state, wp.array([False, True, False], dtype=wp.bool, device="cpu"))
    solver.step(state, after, None, None, PERIOD)  # shorter than the delay
    moved = np.abs(after.joint_q.numpy() - state.joint_q.numpy()).reshape(2, 2).max(axis=1)
    assert moved[0] < 1e-6
    assert moved[1] > 1e-3


def test_bodies_follow_the_joints() -> None:
    """Viewers see links where the joints put them."""
    model = build_model(load_mechanism("finger"), 1, device="cpu")
    solver = TendonSolver(model, MODEL)
    state = model.state()
    solver.command.fill_(2.0)
    solver.settle(state)
    solver.step(state, state, None, None, PERIOD)
    angle = float(state.joint_q.numpy()[0])
    distal = state.body_q.numpy()[1]
    assert distal[[0, 2]] == pytest.approx(
        [0.030 * np.cos(angle), -0.030 * np.sin(angle)], abs=1e-6
    )


def test_contacts_are_of_others_are_refused() -> None:
    """What is not taken over is not silently left out."""
    solver, model = make_solver(1)
    state = model.state()
    with pytest.raises(InvalidParameter, match="finds contacts with obstacles itself"):
        solver.step(state, state, None, newton.Contacts(1, 1, device="cpu"), PERIOD)
    with pytest.raises(InvalidParameter, match="max_step"):
        make_solver(1, max_step=0.0)
    with pytest.raises(InvalidParameter, match="load_cell_lag"):
        TendonSolver(model, ideal_model(load_cell_lag={"time_constant": 0.1}))
