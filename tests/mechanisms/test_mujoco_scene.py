"""Hands and things that move as MJCF: names, masses, which shapes meet, and how firmly."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Box, Plane, Sphere
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import closing_tension, equilibrium
from tendon_newton.mechanisms.loading import load_mechanism

FLOAT32 = 1e-6  # relative: Newton's arrays are float32


def exported(mechanism: Mechanism, folder: Path) -> mujoco.MjModel:
    """Return what plain MuJoCo reads of a mechanism."""
    path = folder / "scene.xml"
    write_mujoco(path, mechanism)
    return mujoco.MjModel.from_xml_path(str(path))


def settled(model: mujoco.MjModel, seconds: float) -> mujoco.MjData:
    """Return a model after a while without a motor's force."""
    data = mujoco.MjData(model)
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return data


def test_a_hand_has_names_with_its_fingers(tmp_path: Path) -> None:
    """Four fingers of three joints, each with a motor on its tendon."""
    path = tmp_path / "hand.xml"
    assert main(["asset", "export", "hand", "--out", str(path)]) == 0
    model = mujoco.MjModel.from_xml_path(str(path))
    joints = [model.joint(k).name for k in range(model.njnt)]
    assert joints[:3] == ["index_mcp", "index_pip", "index_dip"]
    assert len(set(joints)) == 12
    motors = [model.actuator(k).name for k in range(model.nu)]
    assert motors == ["index_flexor", "little_flexor", "middle_flexor", "ring_flexor"]
    masses = [joint.mass for joint in load_mechanism("hand").joints]
    assert model.body_mass[1:] == pytest.approx(masses, rel=FLOAT32)


def test_a_finger_keeps_its_short_names(tmp_path: Path) -> None:
    """Nothing that is unique gets longer, and nothing meets anything."""
    model = exported(load_mechanism("finger_routed"), tmp_path)
    assert [model.joint(k).name for k in range(model.njnt)] == ["mcp", "pip", "dip"]
    assert model.npair == 0


def test_what_moves_has_its_mass_and_inertia(tmp_path: Path) -> None:
    """A ball's and a block's are those of a solid."""
    ball = Sphere(position=[0.0, 0.1, 0.0], radius=0.02, mass=0.03)
    block = Box(position=[0.0, 0.1, 0.0], half_size=[0.01, 0.02, 0.03], mass=0.04)
    for name, body in (("ball", ball), ("block", block)):
        model = exported(load_mechanism("finger").with_obstacles(body), tmp_path)
        there = model.body(name)
        assert there.mass[0] == pytest.approx(body.mass)
        assert there.inertia == pytest.approx(body.inertia, rel=1e-5)
        assert model.joint(name).type == mujoco.mjtJoint.mjJNT_FREE


def test_shapes_meet_as_in_our_own_solver(tmp_path: Path) -> None:
    """Links with all, what moves with what stays; the smaller friction counts between these."""
    ball = Sphere(position=[0.0, 0.1, 0.0], radius=0.02, mass=0.03, friction=0.7)
    floor = Plane(position=[0.0, 0.0, -0.2], normal=[0.0, 0.0, 1.0], friction=0.2)
    edge = Box(position=[0.3, 0.0, 0.0], half_size=[0.01, 0.01, 0.01], friction=0.9)
    model = exported(load_mechanism("finger").with_obstacles(floor, ball, edge), tmp_path)
    rows = zip(model.pair_geom1, model.pair_geom2, model.pair_friction[:, 0], strict=True)
    pairs = {
        frozenset((model.geom(int(a)).name, model.geom(int(b)).name)): float(friction)
        for a, b, friction in rows
    }
    bones = ("middle_phalanx_bone", "distal_phalanx_bone")
    expected = {frozenset((bone, "obstacle_0")): 0.2 for bone in bones}
    expected |= {frozenset((bone, "ball")): 0.7 for bone in bones}
    expected |= {frozenset((bone, "obstacle_2")): 0.9 for bone in bones}
    expected |= {frozenset(("ball", "obstacle_0")): 0.2, frozenset(("ball", "obstacle_2")): 0.7}
    assert pairs == pytest.approx(expected)


def test_a_ball_rests_as_deep_as_its_stiffness_says(tmp_path: Path) -> None:
    """The depth is m g / k, to 1 %."""
    ball = Sphere(position=[0.2, 0.0, 0.0195], radius=0.02, mass=0.05, stiffness=2000.0)
    floor = Plane(position=[0.0, 0.0, 0.0], normal=[0.0, 0.0, 1.0])
    finger = load_mechanism("finger").with_obstacles(ball, floor)
    model = exported(finger, tmp_path)
    data = settled(model, 1.5)
    depth = 0.02 - data.body("ball").xpos[2]
    assert depth == pytest.approx(0.05 * 9.81 / 2000.0, rel=0.01)
    assert np.abs(data.qvel).max() < 1e-4


def test_a_finger_is_pushed_off_a_fixed_ball_as_hard_as_in_statics(tmp_path: Path) -> None:
    """A tendon's pull against a ball: half the stiffness, twice the depth, to 10 %."""
    depths = []
    for stiffness in (2000.0, 1000.0):
        ball = Sphere(
            position=[0.015, 0.0, -0.0145], radius=0.01, stiffness=stiffness, friction=0.0
        )
        finger = replace(load_mechanism("finger"), obstacles=(ball,))
        model = exported(finger, tmp_path)
        data = mujoco.MjData(model)
        data.ctrl[:] = 3.0
        for _ in range(3000):
            mujoco.mj_step(model, data)
        depths.append(-sum(min(float(contact.dist), 0.0) for contact in data.contact))
    assert depths[1] == pytest.approx(2.0 * depths[0], rel=0.1)


DURATION = 1.0  # s, many time constants of every bench
STEP = 5.0e-4  # s: at 1 ms a light finger bounces on MuJoCo's end stops, at 2 ms it diverges


@pytest.mark.parametrize("name", asset_names())
def test_mujoco_settles_where_statics_says(name: str, tmp_path: Path) -> None:
    """Half the closing force of the first motor leads to the equilibrium."""
    mechanism = replace(load_mechanism(name), obstacles=())  # statics know of no contact
    model = exported(mechanism, tmp_path)
    model.opt.timestep = STEP
    model.actuator_ctrllimited[:] = False  # a spring takes more than its servo can give
    if not np.any(model.dof_damping > 0.0):
        # a pendulum without damping never settles; so it does within 0.15 s
        model.dof_damping[:] = 0.15 * closing_tension(mechanism)
    first = mechanism.tendons[0]
    tension = np.zeros(len(mechanism.tendons))
    tension[0] = 0.5 * closing_tension(mechanism)
    data = mujoco.MjData(model)
    data.ctrl[:] = tension
    mujoco.mj_step(model, data, round(DURATION / STEP))
    mujoco.mj_forward(model, data)
    reached = excursion(first, data.qpos)
    # 1 %: what remains of the motion, and MuJoCo's own treatment of soft stops.
    assert reached == pytest.approx(excursion(first, equilibrium(mechanism, tension)), rel=0.01)
    # MuJoCo's tendon is the same: l = sum(arm q), or what a path grows shorter.
    length = float(data.ten_length[0])
    wound = length if first.route is None else first.route.rest_length - length
    assert wound == pytest.approx(reached, rel=1e-5)  # float32 of the asset
