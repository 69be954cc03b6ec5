"""Equilibria against formulas derived by hand."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from newton.solvers import SolverMuJoCo

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.arms import with_arm, without_arm
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, arm_slope, moment_arms
from tendon_newton.mechanisms.geometry.statics import (
    closing_path,
    closing_tension,
    equilibrium,
    gravity_torque,
)
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.mechanism_rules import range_positions
from tendon_newton.mechanisms.worlds import build_model
from tests.effect_bench import commanded, simulate
from tests.mechanisms.broken.flat_assets import write_changed

WEIGHTLESS = np.zeros(3)


def test_weightless_finger_follows_its_springs() -> None:
    """Without gravity k_j q_j = a_j T, so q = (0.0080 T / 0.045, 0.0055 T / 0.030)."""
    q = equilibrium(load_mechanism("finger"), np.array([5.0]), gravity=WEIGHTLESS)
    assert q == pytest.approx([0.0080 * 5.0 / 0.045, 0.0055 * 5.0 / 0.030], rel=1e-6)


def test_joint_past_its_range_rests_on_the_stop() -> None:
    """At 9 N the DIP leans on its stop: a T = k q + 30 (q - u) with u = 1.40 rad."""
    q = equilibrium(load_mechanism("finger"), np.array([9.0]), gravity=WEIGHTLESS)
    excess = (0.0055 * 9.0 - 0.030 * 1.40) / (30.0 + 0.030)
    assert q[1] - 1.40 == pytest.approx(excess, abs=1e-7)  # the asset's 1.40 rad are float32


def test_positive_joint_angle_flexes_towards_the_ground() -> None:
    """At q = (90 deg, 0) the straight finger points along -z."""
    tip = tip_position(load_mechanism("finger"), np.array([np.pi / 2.0, 0.0]))
    assert tip == pytest.approx([0.0, 0.0, -0.055], abs=1e-8)


def test_tip_of_the_bent_finger_is_plane_trigonometry() -> None:
    """Tip x = L1 cos q1 + L2 cos(q1 + q2), z = -(L1 sin q1 + L2 sin(q1 + q2))."""
    a, b = 0.7, 0.4
    tip = tip_position(load_mechanism("finger"), np.array([a, b]))
    assert tip == pytest.approx(
        [
            0.030 * np.cos(a) + 0.025 * np.cos(a + b),
            0.0,
            -0.030 * np.sin(a) - 0.025 * np.sin(a + b),
        ],
        abs=1e-8,
    )


def test_gravity_flexes_the_straight_finger() -> None:
    """PIP: g (m1 L1/2 + m2 (L1 + L2/2)); DIP: g m2 L2/2."""
    torque = gravity_torque(load_mechanism("finger"), np.zeros(2))
    pip = 9.81 * (0.012 * 0.015 + 0.008 * (0.030 + 0.0125))
    assert torque == pytest.approx([pip, 9.81 * 0.008 * 0.0125], rel=1e-6)


def test_slider_travels_by_hooke() -> None:
    """Travel is T / k, whatever the weight: the rail is level."""
    assert equilibrium(load_mechanism("spring_weak"), np.array([10.0])) == pytest.approx([0.05])
    assert closing_tension(load_mechanism("spring_strong")) == pytest.approx(64.0)


def test_pendulum_is_held_by_the_sine_of_its_angle() -> None:
    """T = m g L sin q, in both directions."""
    pendulum = load_mechanism("pendulum")
    torque = 0.49 * 9.81 * 0.10 * np.sin(0.6)
    assert equilibrium(pendulum, np.array([torque])) == pytest.approx([0.6], rel=1e-6)
    assert equilibrium(pendulum, np.array([-torque])) == pytest.approx([-0.6], rel=1e-6)


def test_torque_beyond_the_weight_has_no_equilibrium() -> None:
    """Above m g L the pendulum turns over, and the search says so."""
    with pytest.raises(InvalidParameter, match="no equilibrium"):
        equilibrium(load_mechanism("pendulum"), np.array([0.6]))


def test_closing_path_ends_with_every_joint_closed() -> None:
    """At the closing tension the last joint has just reached its limit; none is short of it."""
    finger = load_mechanism("finger")
    path = closing_path(finger, gravity=WEIGHTLESS)
    assert path.tension[-1] == pytest.approx(0.045 * 1.75 / 0.0080, rel=1e-6)
    upper = np.array(finger.joint_limits)[:, 1]
    # Stops give way: 30 N m/rad under a few mN m.
    assert path.joint_position[-1] == pytest.approx(upper, abs=1e-3)


def test_stretched_finger_stretches_its_path() -> None:
    """Kinematics use the mechanism given, not the asset: twice the length, twice the reach."""
    finger = load_mechanism("finger")
    assert finger.tip is not None
    far = replace(finger, tip=replace(finger.tip, point=np.array([0.050, 0.0, 0.0])))
    assert tip_position(far, np.zeros(2)) == pytest.approx([0.080, 0.0, 0.0], abs=1e-8)


LOAD, LENGTH, ARM = 0.5, 0.15, 0.12  # [kg], [m], [kg]


@pytest.mark.parametrize("space", [True, False])
def test_an_arm_can_be_taken_off_again(space: bool) -> None:
    """Two bodies in the plane or in space come back, to rounding (1e-15)."""
    centre = np.array([[0.1, 0.0, -0.2], [0.0, 0.05, -0.1]])
    inertia = np.array([2e-4 * np.eye(3), 1e-4 * np.eye(3)])
    load = (np.array([0.5, 0.2]), centre, inertia) if space else (
        np.array([0.5, 0.2]), centre[:, :2], np.array([2e-4, 1e-4])
    )  # fmt: skip
    arm = np.array([0.1, 0.3])
    for again, first in zip(without_arm(with_arm(load, arm), arm), load, strict=True):
        np.testing.assert_allclose(again, first, atol=1e-15, rtol=1e-12)


def test_half_an_arm_weighs_and_a_third_resists() -> None:
    """A point mass on an arm: m l + a l / 2 for gravity, m l^2 + a l^2 / 3 about the joint."""
    sizes = BenchOverrides(mass=(LOAD,), length=(LENGTH,), arm_mass=(ARM,))
    (joint,) = override_mechanism(load_mechanism("pendulum"), sizes).joints
    centre = float(np.linalg.norm(joint.center_of_mass - joint.child_position))
    assert joint.mass == pytest.approx(LOAD + ARM)
    assert joint.mass * centre == pytest.approx(LOAD * LENGTH + 0.5 * ARM * LENGTH)
    about = joint.inertia[1, 1] + joint.mass * centre**2
    assert about == pytest.approx((LOAD + ARM / 3.0) * LENGTH**2, rel=1e-6)


def test_an_arm_stays_where_a_log_states_another_load() -> None:
    """A model gives the arm, a log its load: both count, in either order, and once."""
    bench = load_mechanism("pendulum")
    arm, load = BenchOverrides(arm_mass=(ARM,)), BenchOverrides(mass=(LOAD,), length=(LENGTH,))
    both = override_mechanism(bench, replace(load, arm_mass=(ARM,)))
    for first, second in ((arm, load), (load, arm)):
        (one,), (other,) = (
            override_mechanism(override_mechanism(bench, first), second).joints,
            (both.joints),
        )
        assert one.mass == pytest.approx(other.mass)
        np.testing.assert_allclose(one.center_of_mass, other.center_of_mass, atol=1e-12)
        np.testing.assert_allclose(one.inertia, other.inertia, atol=1e-12)


def test_a_heavy_arm_sags_like_a_heavier_load() -> None:
    """At rest against an ideal servo's gain an arm counts as half its mass at the load."""
    recording = commanded(np.full(400, 1.0), "pendulum")
    angles = [
        simulate(
            replace(recording, bench_overrides=BenchOverrides(length=(LENGTH,), **sizes))
        ).motor_position[-1, 0]
        for sizes in (
            {"mass": (LOAD,), "arm_mass": (ARM,)},
            {"mass": (LOAD + 0.5 * ARM,)},
            {"mass": (LOAD,)},
        )
    ]
    assert angles[0] == pytest.approx(angles[1], abs=1e-4)
    assert abs(angles[0] - angles[2]) > 1e-3


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
    return tendon.route.rest_length - tendon.route.excursion(postures)


def wrapped_share(mechanism: Mechanism, postures: np.ndarray) -> float:
    """Return in how many of the postures a string touches the first pulley [1]."""
    route = mechanism.tendons[0].route
    # A drawn arc has two dozen points, a straight span one.
    counts = np.array([len(route.points(q)) for q in postures])
    return float(np.mean(counts > len(route.spans) + 1))


@pytest.mark.parametrize("name", ROUTED)
def test_lengths_and_arms_are_those_of_the_spatial_tendons_of_mujoco(name: str) -> None:
    """To 1e-7 m; asked for are 1e-5 m. The arms to 1e-6 m/rad."""
    mechanism = load_mechanism(name)
    postures = draw_postures(mechanism)
    model = in_mujoco(mechanism)
    found, arms = map(np.array, zip(*(mujoco_arms(model, q) for q in postures), strict=True))
    for d, tendon in enumerate(mechanism.tendons):  # float32 numbers of the asset
        assert found[:, d] == pytest.approx(lengths(tendon, postures), abs=1e-7)
        assert arms[:, d] == pytest.approx(moment_arms(tendon, postures), abs=1e-6)


def in_mujoco(mechanism: Mechanism, own: BenchOverrides | None = None) -> mujoco.MjModel:
    """Return MuJoCo's view of a world."""
    model = build_model(mechanism, 1, overrides=own and [own], device="cpu")
    return SolverMuJoCo(model, disable_contacts=True, use_mujoco_cpu=True).mj_model


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
def test_a_string_meets_and_leaves_its_pulley_where_mujoco_says(height, oblique, tmp_path) -> None:
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
    model = in_mujoco(mechanism)
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
    """Sites keep their share of the link; so does MuJoCo's view of them in that world."""
    mechanism = load_mechanism("finger_routed")
    same, longer = BenchOverrides(), BenchOverrides(length=(0.050, 0.026, 0.021))
    q = np.array([0.5, 0.7, 0.4])
    found, expected = [], []
    for own in (same, longer):
        found.append(mujoco_arms(in_mujoco(mechanism, own), q)[0][0])
        tendon = override_mechanism(mechanism, own).tendons[0]
        expected.append(lengths(tendon, q[None])[0])
    assert found == pytest.approx(expected, abs=1e-7)
    assert expected[1] - expected[0] > 3.0e-3  # 8 mm more of a link, less what it is bent


def test_the_assets_are_those_that_are_compared() -> None:
    """Every asset with a routed tendon is in the table of this file."""
    folder = asset_path("finger").parents[1]
    texts = {p.parent.name: p.read_text() for p in folder.glob("*/tendon.usda")}
    routed = {name for name, text in texts.items() if '"spatial"' in text}
    assert routed | {"hand"} == set(ROUTED)
