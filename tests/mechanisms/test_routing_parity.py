"""Routed tendons against MuJoCo's spatial tendons, which are read from the same prims."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from newton.solvers import SolverMuJoCo

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, arm_slope, moment_arms
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.mechanism_rules import range_positions
from tendon_newton.mechanisms.worlds import build_model
from tests.mechanisms.broken.test_broken_assets import write_changed

ROUTED = ("finger_routed", "finger_antagonist", "thumb", "hand")
POSTURES = 48
PULLEY = "double3 xformOp:translate = (-0.014, 0, -0.0165)"
SIDE = "double3 xformOp:translate = (-0.014, 0, -0.0105)"
OBLIQUE = (
    'uniform token[] xformOpOrder = ["xformOp:translate"]\n',
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]\n'
    "                double3 xformOp:rotateXYZ = (25, 0, 15)\n",
)


def draw_postures(mechanism: Mechanism) -> np.ndarray:
    """Return joint positions all over the range [rad], shape (N, J), as float32 holds them."""
    lower, upper = np.array(mechanism.joint_limits).T
    shares = np.random.default_rng(5).uniform(size=(POSTURES, len(lower)))
    return (lower + shares * (upper - lower)).astype(np.float32).astype(np.float64)


def lengths(tendon: Tendon, postures: np.ndarray) -> np.ndarray:
    """Return our lengths of a routed tendon [m], shape (N,)."""
    assert tendon.route is not None
    return tendon.route.rest_length - tendon.route.excursion(postures)


def wrapped_share(mechanism: Mechanism, postures: np.ndarray) -> float:
    """Return in how many of the postures a string touches the first pulley [1]."""
    route = mechanism.tendons[0].route
    assert route is not None
    # A drawn arc has two dozen points, a straight span one.
    counts = np.array([len(route.points(q)) for q in postures])
    return float(np.mean(counts > len(route.spans) + 1))


@pytest.mark.parametrize("name", ROUTED)
def test_lengths_and_arms_are_those_of_the_spatial_tendons_of_solver_mujoco(name: str) -> None:
    """To 1e-7 m, its float32; asked for are 1e-5 m. The arms to 1e-6 m/rad."""
    mechanism = load_mechanism(name)
    postures = draw_postures(mechanism)
    model = build_model(mechanism, len(postures), device="cpu")
    solver = SolverMuJoCo(model, disable_contacts=True)
    state, after = model.state(), model.state()
    state.joint_q.assign(postures.ravel().astype(np.float32))
    solver.step(state, after, model.control(), None, 1.0e-6)
    found = solver.mjw_data.ten_length.numpy()
    for d, tendon in enumerate(mechanism.tendons):
        assert found[:, d] == pytest.approx(lengths(tendon, postures), abs=1e-7)
        ours = moment_arms(tendon, postures)
        theirs = [mujoco_arms(solver.mj_model, q)[1][d] for q in postures]
        assert np.array(theirs) == pytest.approx(ours, abs=1e-6)  # float32 numbers of the asset


def mujoco_arms(model: mujoco.MjModel, posture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths [m] and moment arms [m/rad] of MuJoCo's own C code, positive closes."""
    data = mujoco.MjData(model)
    data.qpos[:] = posture
    mujoco.mj_forward(model, data)
    slope = np.zeros((model.ntendon, model.nv))
    if data.ten_J.size == slope.size:
        slope = data.ten_J.reshape(slope.shape)
    else:
        mujoco.mju_sparse2dense(
            slope, data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind
        )
    return data.ten_length.copy(), -slope


@pytest.mark.parametrize("oblique", [False, True])
@pytest.mark.parametrize("height", [-0.0165, -0.0155, -0.0135])
def test_a_string_meets_and_leaves_its_pulley_where_mujoco_says(
    height: float, oblique: bool, tmp_path: Path
) -> None:
    """Free, wrapped and both; around an axis across the string and an oblique one."""
    above = SIDE.replace("-0.0105", f"{height + 0.006}")
    changes = [(PULLEY, PULLEY.replace("-0.0165", f"{height}")), (SIDE, above)]
    path = write_changed(tmp_path, "finger_routed", *changes)
    if oblique:
        text = path.read_text()
        start = text.index('def Cylinder "flexor_pulley"')
        path.write_text(text[:start] + text[start:].replace(*OBLIQUE, 1))
    mechanism = load_mechanism(path)
    postures = draw_postures(mechanism)
    model = SolverMuJoCo(build_model(mechanism, 1, device="cpu"), disable_contacts=True).mj_model
    found = [mujoco_arms(model, q) for q in postures]
    ours = lengths(mechanism.tendons[0], postures)
    assert np.array([length[0] for length, _ in found]) == pytest.approx(ours, abs=1e-7)
    arms = moment_arms(mechanism.tendons[0], postures)
    assert np.array([arm[0] for _, arm in found]) == pytest.approx(arms, abs=1e-6)
    assert wrapped_share(mechanism, postures) > 0.3


@pytest.mark.parametrize("name", ROUTED[:3])
def test_the_arms_slope_is_their_difference(name: str) -> None:
    """Second derivatives of the length against central differences of the arms, in float64."""
    mechanism = load_mechanism(name)
    h = 1.0e-6
    for tendon in mechanism.tendons:
        for q in range_positions(mechanism, 7):
            steps = h * np.eye(q.size)
            slopes = [
                (moment_arms(tendon, q + e) - moment_arms(tendon, q - e)) / (2.0 * h) for e in steps
            ]
            # 1e-8 m/rad2: rounding of the difference
            assert arm_slope(tendon, q) == pytest.approx(np.array(slopes), abs=1e-8)


def test_a_stretched_link_carries_its_sites_with_it() -> None:
    """Sites keep their share of the link; so does MuJoCo's view of them in that world alone."""
    from tendon_newton.data.recording import BenchOverrides

    mechanism = load_mechanism("finger_routed")
    longer = override_mechanism(mechanism, BenchOverrides(length=(0.050, 0.026, 0.021)))
    model = build_model(
        mechanism,
        2,
        overrides=[BenchOverrides(), BenchOverrides(length=(0.050, 0.026, 0.021))],
        device="cpu",
    )
    q = np.array([0.5, 0.7, 0.4])
    solver = SolverMuJoCo(model, disable_contacts=True)
    state, after = model.state(), model.state()
    state.joint_q.assign(np.tile(q, 2).astype(np.float32))
    solver.step(state, after, model.control(), None, 1.0e-6)
    found = solver.mjw_data.ten_length.numpy()[:, 0]
    assert found[0] == pytest.approx(lengths(mechanism.tendons[0], q[None])[0], abs=1e-7)
    stretched = lengths(longer.tendons[0], q[None])[0]
    assert stretched - found[0] > 3.0e-3  # 8 mm more of a link, less what it is bent
    assert found[1] == pytest.approx(stretched, abs=1e-7)


def test_the_assets_are_those_that_are_compared() -> None:
    """Every asset with a routed tendon is in the table of this file."""
    folder = asset_path("finger").parents[1]
    texts = {p.parent.name: p.read_text() for p in folder.glob("*/tendon.usda")}
    routed = {name for name, text in texts.items() if '"spatial"' in text}
    assert routed | {"hand"} == set(ROUTED)
