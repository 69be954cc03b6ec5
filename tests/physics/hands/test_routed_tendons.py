"""Tendons whose arms follow from their paths: statics, order, energy, sticking, gradients."""

import mujoco
import newton
import numpy as np
import pytest
from newton.solvers import SolverMuJoCo
from scipy.optimize import minimize

from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.conftest import SEED
from tests.physics.gradients.test_gradients import difference, loss_of, random_seeds
from tests.physics.runs import ASLEEP, follow, ideal_model, run_of, simulate, stairs

STEP = 2.5e-4  # s
STEPS = (2.0e-3, 1.0e-3, 5.0e-4, 2.5e-4)
FINE = 1.25e-5  # s
TENSIONS = {
    "finger_routed": ((1.0,), (3.0,), (5.0,)),
    "finger_antagonist": ((1.5, 0.0), (2.0, 0.5)),
    "thumb": ((1.0,), (3.0,), (5.0,)),
}


def potential(mechanism: Mechanism, q: np.ndarray) -> float:
    """Return the energy of springs, end stops and weights [J]."""
    lower, upper = np.array(mechanism.joint_limits).T
    stiffness, rest, stops, masses = (
        np.array([getattr(joint, name) for joint in mechanism.joints])
        for name in ("stiffness", "rest", "stop_stiffness", "mass")
    )
    frames = posture(mechanism, q)
    centres = [frames.place(j, joint.center_of_mass) for j, joint in enumerate(mechanism.joints)]
    beyond = np.maximum(q - upper, 0.0) + np.minimum(q - lower, 0.0)
    springs = 0.5 * stiffness @ (q - rest) ** 2 + 0.5 * stops @ beyond**2
    return float(springs - masses @ (np.array(centres) @ mechanism.gravity))


@pytest.mark.parametrize("name", TENSIONS)
def test_it_rests_where_the_energy_is_least_with_the_lengths_of_mujoco(name: str) -> None:
    """Springs, weights and tension times MuJoCo's own tendon length, minimised by scipy.

    No moment arm is in it.
    """
    mechanism = load_mechanism(name)
    built = build_model(mechanism, 1, device="cpu")
    model = SolverMuJoCo(built, disable_contacts=True, use_mujoco_cpu=True).mj_model
    data = mujoco.MjData(model)

    for tension in TENSIONS[name]:

        def energy(q: np.ndarray, pull: tuple[float, ...] = tension) -> float:
            data.qpos[:] = q
            mujoco.mj_forward(model, data)
            return 1.0e3 * (potential(mechanism, q) + float(np.dot(pull, data.ten_length)))

        start = np.full(len(mechanism.joints), 0.3)
        found = minimize(energy, start, method="BFGS", options={"gtol": 1.0e-7}).x
        rest = equilibrium(mechanism, np.array(tension))
        # 1e-4 rad: what BFGS leaves with gradients by differences
        assert found == pytest.approx(rest, abs=1e-4)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("finger_routed", marks=pytest.mark.slow),
        "finger_antagonist",
        pytest.param("thumb", marks=pytest.mark.slow),
    ],
)
def test_the_solver_settles_and_stays_where_statics_says(name: str) -> None:
    """Tension as the load cell reads it, and joints to 1e-6 rad; after 0.5 s they are there yet."""
    mechanism = load_mechanism(name)
    model = build_model(mechanism, 1, device="cpu")
    solver = TendonSolver(model, ideal_model(), max_step=2.0e-3, update_bodies=False)
    state = model.state()
    command = np.array([[2.0, -0.2][: len(mechanism.tendons)]], dtype=np.float32)
    solver.command.assign(command)
    solver.settle(state)
    settled = state.joint_q.numpy().copy()
    solver.read_sensors(state)
    tension = solver.force.numpy()[0].astype(np.float64)
    rest = equilibrium(mechanism, tension, start=settled.astype(np.float64))
    assert settled == pytest.approx(rest, abs=2e-6)  # float32 of tension and joints
    wound = [excursion(tendon, settled) / tendon.spool_radius for tendon in mechanism.tendons]
    assert solver.motor_position.numpy()[0] == pytest.approx(wound, abs=1e-6)
    for _ in range(10):
        solver.step(state, state, None, None, 0.05)
    assert state.joint_q.numpy() == pytest.approx(settled, abs=2e-6)


def test_error_falls_with_the_square_of_the_step() -> None:
    """The scheme keeps its order where arms turn; so it does with an actuator that lags."""
    mechanism = load_mechanism("finger_routed")
    run = run_of(
        [2.5, 2.5], rate=50.0, start="first_row", angle=1.5, speed=2.0, bench="finger_routed"
    )
    model = ideal_model(actuator_lag={"time_constant": 0.01})

    def end(step: float) -> np.ndarray:
        return simulate([run], model, time_step=step, mechanism=mechanism)[0].joint_position[-1]

    fine = end(FINE)
    errors = [float(np.abs(end(step) - fine).max()) for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert 1.8 < order < 2.3, f"errors {errors}"


def stick_and_swing(step: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Let joints swing while friction holds their tendon; return joints (count, J) and l [m]."""
    mechanism = load_mechanism("finger_routed")
    model = build_model(mechanism, 1, device="cpu")
    solver = TendonSolver(
        model,
        ideal_model(**{**ASLEEP, "coulomb_friction": {"force": 8.0}}),
        max_step=step,
        update_bodies=False,
    )
    state = model.state()
    solver.command.fill_(2.0)
    solver.settle(state)
    q = state.joint_q.numpy().astype(np.float64)
    arms = moment_arms(mechanism.tendons[0], q)
    swing = np.array([arms[1], -arms[0], 0.0])  # along which the tendon does not move
    state.joint_qd.assign((4.0 * swing / np.linalg.norm(swing)).astype(np.float32))
    solver.reset(state)
    path = np.zeros((count, 3))
    for k in range(count):
        solver.step(state, state, None, None, 2.0e-3)
        path[k] = state.joint_q.numpy()
    return path, excursion(mechanism.tendons[0], path)


def test_a_tendon_that_sticks_holds_its_length_while_its_joints_move() -> None:
    """The joints swing by two degrees, and the string moves by nanometres at any step.

    Its constraint turns as they do.
    """
    for step in (1.0e-3, 2.5e-4):
        path, wound = stick_and_swing(step, 25)
        assert np.all(np.ptp(path, axis=0) > [0.02, 0.005, 0.02])
        assert np.ptp(wound) < 1.0e-8  # float32 of the joints: 6e-8 rad on 0.01 m, summed


def test_tendon_work_is_energy_gained_plus_heat() -> None:
    """Work of the tension = change of energy + damping, along a smooth command."""
    mechanism = load_mechanism("finger_routed")
    model = build_model(mechanism, 1, device="cpu")
    solver = TendonSolver(
        model,
        ideal_model(**{**ASLEEP, "viscous_friction": {"coefficient": 0.2}}),
        max_step=STEP,
        update_bodies=False,
    )
    command = 2.0 - 1.2 * np.cos(2.0 * np.pi * STEP * np.arange(2000) / 0.25)
    q, v, power = follow(solver, model, command, STEP)
    work = np.sum(power.mean(axis=1)) * STEP
    damping = [joint.damping for joint in mechanism.joints]
    heat = np.trapezoid(v**2 @ damping, dx=STEP)
    stored = [potential(mechanism, q[k]) + kinetic(model, q[k], v[k]) for k in (0, -1)]
    assert heat > 0.05 * work
    # 1e-3: trapezium rule where the string meets its pulley, float32 of Newton's state
    assert work == pytest.approx(stored[1] - stored[0] + heat, rel=1e-3)


def kinetic(model: newton.Model, q: np.ndarray, v: np.ndarray) -> float:
    """Return the kinetic energy [J] from the bodies' velocities, as Newton computes them."""
    state = model.state()
    state.joint_q.assign(q.astype(np.float32))
    state.joint_qd.assign(v.astype(np.float32))
    newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    speeds = state.body_qd.numpy().astype(np.float64)
    turned = state.body_q.numpy().astype(np.float64)[:, 3:]
    total = 0.0
    for mass, inertia, speed, (_, y, _, w) in zip(
        model.body_mass.numpy(), model.body_inertia.numpy(), speeds, turned, strict=True
    ):
        assert abs(y * y + w * w - 1.0) < 1e-5  # the finger's links turn about y alone
        total += 0.5 * mass * speed[:3] @ speed[:3] + 0.5 * inertia[1, 1] * speed[4] ** 2
    return float(total)


@pytest.mark.parametrize(
    "name", ["finger_antagonist", pytest.param("thumb", marks=pytest.mark.slow)]
)
def test_gradients_of_a_routed_asset_are_its_differences(name: str) -> None:
    """To 1e-3, and not zero: gain, springs, masses, spools, and points of a string's path.

    Two strings around knuckles, and an axis across the others, from a measured start too. What
    central differences leave is 1e-5.
    """
    rng = np.random.default_rng(SEED)
    mechanism = load_mechanism(name)
    measured = {"start": "first_row", "angle": 1.2, "speed": 0.5} if name == "thumb" else {}
    runs = []
    for highest, seed, more in ((3.0, 4, {}), (2.5, 5, measured)):
        command = stairs(rng, 13, 1.0, highest, seed).reshape(-1, 1)
        loose = np.full((len(command), len(mechanism.tendons) - 1), -0.3)
        runs.append(run_of(np.hstack([command, loose]), bench=name, **more))
    rollout = DifferentiableRollout(mechanism, runs, ideal_model(), device="cpu")
    seeds = random_seeds(rollout)
    inputs = rollout.backward(**seeds)
    last = (1, len(mechanism.joints) - 1)
    cases = [
        (inputs.mechanism.stiffness, (0, 0), 0.03),
        (inputs.mechanism.stiffness, last, 0.03),
        (inputs.mechanism.mass, (0, 0), 0.01),
        (inputs.mechanism.mass, last, 0.01),
        (inputs.mechanism.spool_radius, (1, 0), 0.0125),
        (inputs.mechanism.path_point, (0, 1, 2), 0.01),
        (inputs.mechanism.path_point, (1, 3, 0), 0.01),
        (inputs.parameters, (0, 0), 1.0),
    ]
    taped = [array.grad.numpy()[place].copy() for array, place, _ in cases]
    for (array, place, size), found in zip(cases, taped, strict=True):
        expected = difference(array, place, size, lambda: loss_of(rollout, seeds))
        assert expected != 0.0
        assert found == pytest.approx(expected, rel=1e-3)
