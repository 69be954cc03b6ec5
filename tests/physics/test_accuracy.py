"""What the default step leaves, on commands that real diagnoses see."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import TIME_STEP
from tendon_newton.simulation.hosts.tendon_solver import LONGEST_STEP, TendonSolver
from tests import effect_bench
from tests.conftest import SEED
from tests.made import stated_model
from tests.physics.hands.chains import TREES, write_chain
from tests.physics.mujoco_reference import followed_in_mujoco, torque_of
from tests.physics.runs import RADIUS, ideal_model, run_of, simulate, stairs

ANGLE, FORCE = 0.044e-3, 0.005  # rad, N: a tenth of an encoder's and a load cell's noise
CASES = ("c005", "c008", "c021")
"""Without friction, and the two on which dry friction at the end stops leaves most."""


def kept_rms(error: np.ndarray) -> float:
    """Return the RMS without the worst 2 % of the rows, which are bounces off the end stops."""
    size = np.sort(np.abs(error).ravel())
    return float(np.sqrt(np.mean(size[: int(0.98 * len(size))] ** 2)))


def check(folder: Path) -> None:
    """Compare the default step with one 16 times shorter on every recording of a dataset."""
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    dataset = load_dataset(folder)
    recordings = (*dataset.train, *dataset.test)
    model = load_model(folder / "model.toml")
    coarse = replay(recordings, model)
    fine = replay(recordings, model, time_step=TIME_STEP / 16.0)
    for recording, a, b in zip(recordings, coarse, fine, strict=True):
        where = f"{folder.name}/{recording.name}"
        assert kept_rms(a.motor_position - b.motor_position) < ANGLE, where
        assert kept_rms(a.force - b.force) < FORCE, where


@pytest.mark.parametrize("case", CASES)
def test_the_default_step_leaves_a_tenth_of_the_sensors_noise(case: str, shared: Path) -> None:
    """On the benches and with the starting models of public challenges."""
    check(shared / "challenges" / case)


@pytest.mark.slow
def test_the_default_step_leaves_a_tenth_of_the_noise_on_all_commands(shared: Path) -> None:
    """On every public challenge."""
    for folder in sorted((shared / "challenges").glob("c???")):
        check(folder)


def test_the_default_step_leaves_a_tenth_of_the_noise_of_the_bundled_recordings() -> None:
    """Eight recordings of a finger and two springs that come with the program."""
    check(Path(__file__).parents[2] / "examples" / "hidden_friction")


STEPS = (2.0e-3, 1.0e-3, 5.0e-4, 2.5e-4)
REFERENCE = 1.25e-5
VISCOUS = {"viscous_friction": {"coefficient": 0.2}}
SMOOTH = {
    # no friction reverses and no stop is met while the finger closes
    "ideal": ({}, 0.02),
    "viscous": (VISCOUS, 0.03),
    "dry": ({"coulomb_friction": {"force": 0.5}, **VISCOUS}, 0.03),
    "load": ({"load_dependent_friction": {"coefficient": 0.2}, **VISCOUS}, 0.03),
    "lag": ({"actuator_lag": {"time_constant": 0.01}}, 0.03),
    "compliant": ({"tendon_compliance": {"stiffness": 4000.0}, **VISCOUS}, 0.03),
}


@pytest.mark.parametrize("case", SMOOTH)
def test_error_falls_with_the_square_of_the_step(case: str) -> None:
    """Between events the scheme is of second order."""
    effects, duration = SMOOTH[case]
    errors = [closing_error(effects, duration, step) for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert 1.8 < order < 2.6, (
        f"errors {errors}"
    )  # the coarsest step is not quite in the asymptotic range


def closing_error(effects: dict[str, dict[str, float]], duration: float, step: float) -> float:
    """Return how far a closing finger is from a fine simulation at the end of one row [rad]."""
    run = run_of([2.5, 2.5], rate=1.0 / duration, start="first_row", angle=0.8, speed=2.0)
    coarse, fine = (
        effect_bench.simulate(run, effects, time_step=h).joint_position[-1]
        for h in (step, REFERENCE)
    )
    return float(np.abs(coarse - fine).max())


GAP_STEPS = {2.0e-3: 10.5e-3, 2.5e-4: 1.5e-3, TIME_STEP: 0.6e-3}
"""Step [s] -> how far a rotor behind a gap may be off, RMS [rad]: what docs/lab/method.md tells."""


@pytest.mark.slow
def test_a_rotor_behind_a_gap_is_off_by_what_is_told() -> None:
    """No step ends where the motor's force jumps, at the flanks of the gap."""
    time = np.arange(240) / 80.0
    chirp = 0.9 * np.sin(2.0 * np.pi * (0.3 + 0.12 * time) * time)
    arms = [BenchOverrides(mass=(mass,), length=(0.1,)) for mass in (0.05, 0.3)]
    runs = [run_of(chirp, bench="pendulum", bench_overrides=arm) for arm in arms]
    for constant in (0.4, 0.8):
        servo = {
            "duty_per_rad": 4.0, "max_duty": 1.0, "supply_voltage": 5.0, "resistance": 3.4,
            "torque_constant": constant, "armature": 0.002, "spool_radius": RADIUS,
        }  # fmt: skip
        effects = {"coulomb_friction": {"force": 0.02}, "backlash": {"width": 0.04}}
        model = stated_model("pwm_servo", servo, effects)
        fine = simulate(runs, model, time_step=2.0e-5)
        for step, bound in GAP_STEPS.items():
            for out, best in zip(simulate(runs, model, time_step=step), fine, strict=True):
                off = out.motor_position - best.motor_position
                assert np.sqrt(np.mean(off**2)) < bound, (constant, step)


STEP = 5.0e-4  # s
HOLDING = -0.3  # rad
WITHOUT_HANDS = [n for n in asset_names() if n != "servo" and not n.startswith("hand")]
COMMANDS = {"pendulum": (-0.1, 0.1)}
"""Commands that keep a bench off its stops [rad], where they are not those of the finger."""


def disagreement(mechanism: Mechanism, bench: str, lower: float, upper: float) -> float:
    """Return the greatest RMS difference of a joint as a share of the range it moves through."""
    rng = np.random.default_rng(1)
    # more than one recording: worlds of different length in one solver
    commands = [stairs(rng, rows, lower, upper, 40) for rows in (121, 81)]
    # a second tendon holds against the first
    held = [np.full((len(c), len(mechanism.tendons) - 1), HOLDING) for c in commands]
    runs = [
        run_of(np.column_stack([command, rest]), bench=bench)
        for command, rest in zip(commands, held, strict=True)
    ]
    ours = simulate(runs, ideal_model(), time_step=STEP, mechanism=mechanism)
    shares = []
    for run, motion in zip(runs, (made.joint_position for made in ours), strict=True):
        assert run.command is not None
        other = followed_in_mujoco(mechanism, run.command, motion[0], step=STEP)
        shares.append(np.sqrt(np.mean((motion - other) ** 2, axis=0)) / np.ptp(motion, axis=0))
    return float(np.max(shares))


# the servo's load is unknown: its bare horn is there to be looked at, and turned by positions
# alone; the hand is four of the routed fingers, and its twelve joints take a compiler minutes
@pytest.mark.parametrize("name", WITHOUT_HANDS)
def test_every_asset_moves_as_its_mjcf_file_in_mujoco(name: str) -> None:
    """Without friction the trajectories agree to 1 % of the motion."""
    lower, upper = COMMANDS.get(name, (0.5, 2.5))
    assert disagreement(load_mechanism(name), name, lower, upper) < 0.01


@pytest.mark.parametrize("tree", TREES)
def test_chains_of_three_move_alike(tree: str, tmp_path: Path) -> None:
    """Three joints in a plane, with axes that are not parallel, and in a tree with two branches."""
    mechanism = load_mechanism(write_chain(tmp_path, tree))
    assert len(mechanism.joints) == 3
    assert disagreement(mechanism, "finger", 0.5, 2.0) < 0.01


WORLDS = 96
GREATEST = 8.0  # rad, beyond what a policy may ask for: the servo's limit is reached at 5 rad
BALANCED = 1.0e-6  # N m
FASTEST = 600.0  # rad/s: the pendulum, undamped, turns as fast
BEYOND = 0.1  # rad: what a blow of 20 N presses into a stop of 30 N m/rad, and more
HOLD = 0.05  # s
COARSE = 2.0e-3  # s
LEFT_OUT = ("servo", "hand_ball", "hand_pen")  # Of no force; the hand again, empty
every_asset = pytest.mark.parametrize("name", [n for n in asset_names() if n not in LEFT_OUT])


def alone(name: str) -> Mechanism:
    """Return an asset's mechanism without what it holds: statics know of no contact."""
    return replace(load_mechanism(name), obstacles=())


def rounded(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose ranges are float32, as Newton's model has them."""
    joints = tuple(
        replace(joint, limits=(float(np.float32(low)), float(np.float32(high))))
        for joint in mechanism.joints
        for low, high in [joint.limits]
    )
    return replace(mechanism, joints=joints)


def imbalance(mechanism: Mechanism, q: np.ndarray, command: np.ndarray) -> float:
    """Return the greatest torque that nothing balances [N m], from numpy's own lengths and arms."""
    torque = passive_torque(mechanism, q) + torque_of(mechanism, q, command.astype(np.float64))
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
