"""A corrected bench as URDF."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import newton
import numpy as np
import pytest
from newton.usd import SchemaResolverMjc, SchemaResolverNewton, SchemaResolverPhysx
from scipy.spatial.transform import Rotation

from tendon_newton.exports.urdf_target import ROBOT_FILE, joint_name, write_urdf_target
from tendon_newton.exports.usd_target import BENCH_FILE, WAY, write_usd_target
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import bench_of
from tests.exports.models import ANGLE, FORCE, model_of, strays


def inertia_of(model: mujoco.MjModel, names: tuple[str, ...], q: np.ndarray) -> np.ndarray:
    """Return the mass matrix of a MuJoCo model's joints, in an order, at positions."""
    data = mujoco.MjData(model)
    dofs = [model.joint(name).dofadr[0] for name in names]
    data.qpos[[model.joint(name).qposadr[0] for name in names]] = q
    mujoco.mj_forward(model, data)
    answer = np.zeros((model.nv, model.nv))
    mujoco.mj_solveM(model, data, answer, np.eye(model.nv))
    return np.linalg.inv(answer)[np.ix_(dofs, dofs)]


@pytest.mark.parametrize("bench", ["finger", "thumb", "spring_weak"])
def test_the_links_weigh_and_turn_as_those_of_the_bench(bench: str, tmp_path: Path) -> None:
    """Mass matrices agree in three postures: masses, inertias, places and axes are right."""
    model = model_of(bench, "ideal", "joint_damping_error")
    mechanism = bench_of(bench, model)
    exported = write_urdf_target(tmp_path, mechanism, model)
    ours = mujoco_spec(mechanism).compile()
    theirs = mujoco.MjModel.from_xml_path(str(tmp_path / ROBOT_FILE))
    names = tuple(joint_name(joint) for joint in mechanism.joints)
    rng = np.random.default_rng(0)
    for _ in range(3):
        q = rng.uniform(0.0, 1.0, len(mechanism.joints))
        a, b = inertia_of(ours, mechanism.joint_names, q), inertia_of(theirs, names, q)
        assert a == pytest.approx(b, rel=1e-4, abs=1e-4 * np.abs(a).max())  # float32 in USD
    damping = [theirs.dof_damping[theirs.joint(n).dofadr[0]] for n in names]
    assert damping == pytest.approx([3.0 * joint.damping for joint in mechanism.joints], rel=1e-6)
    assert exported.left_out == {ROBOT_FILE: ()}


def test_a_link_whose_frame_is_turned_weighs_where_it_did(tmp_path: Path) -> None:
    """Its centre and its inertia, turned back from the joint's frame, are the body's own."""
    model = model_of("finger", "ideal")
    mechanism = bench_of("finger", model)
    turn = Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_matrix()
    first = replace(mechanism.joints[0], child_rotation=turn)
    turned = replace(mechanism, joints=(first, *mechanism.joints[1:]))
    write_urdf_target(tmp_path, turned, model)
    inertial = ET.parse(tmp_path / ROBOT_FILE).getroot().findall("link/inertial")[0]
    origin, tensor = inertial.find("origin"), inertial.find("inertia")
    assert origin is not None
    assert tensor is not None
    centre = np.array([float(x) for x in origin.attrib["xyz"].split()])
    assert turn @ centre + first.child_position == pytest.approx(first.center_of_mass, abs=1e-9)
    own = {name: float(value) for name, value in tensor.attrib.items()}
    rows = [[own["".join(("i", *sorted(a + b)))] for b in "xyz"] for a in "xyz"]
    assert turn @ np.array(rows) @ turn.T == pytest.approx(first.inertia, abs=1e-12)


def test_each_part_of_a_hand_has_a_name_of_its_own(tmp_path: Path) -> None:
    """Its fingers' joints share the last part of their paths; MuJoCo reads all of them."""
    model = model_of("hand", "ideal")
    mechanism = bench_of("hand", model)
    write_urdf_target(tmp_path, mechanism, model)
    theirs = mujoco.MjModel.from_xml_path(str(tmp_path / ROBOT_FILE))
    assert theirs.njnt == len(mechanism.joints)
    total = sum(joint.mass for joint in mechanism.joints)
    assert theirs.body_mass.sum() == pytest.approx(total, rel=1e-5)


def test_urdf_says_what_it_cannot(tmp_path: Path) -> None:
    """It has no springs and no gravity."""
    model = model_of("finger", "ideal", "joint_stiffness_error", "gravity_misalignment")
    exported = write_urdf_target(tmp_path, bench_of("finger", model), model)
    assert exported.left_out == {ROBOT_FILE: ("joint_stiffness_error", "gravity_misalignment")}


def test_the_file_holds_what_a_bench_can_hold(tmp_path: Path) -> None:
    """Springs are 1.2 times as stiff in it; the servo's delay stands in the list."""
    model = model_of("finger", "ideal", "joint_stiffness_error", "command_delay")
    exported = write_usd_target(tmp_path, bench_of("finger", model), model)
    before, after = load_mechanism("finger"), load_mechanism(tmp_path / BENCH_FILE)
    for old, new in zip(before.joints, after.joints, strict=True):
        assert new.stiffness == pytest.approx(1.2 * old.stiffness, rel=1e-6)  # float32
    assert exported.left_out == {"other programs": ("command_delay",)}


@pytest.mark.parametrize(
    "others", [(SchemaResolverPhysx,), (SchemaResolverPhysx, SchemaResolverMjc)]
)
def test_friction_comes_through_the_readers_of_isaac(others, tmp_path: Path) -> None:
    """Newton reads a file with PhysX's schemas beside its own in Isaac: no number changes."""
    effects = ("joint_dry_friction", "joint_damping_error")
    model = model_of("finger", "ideal", *effects)
    mechanism = bench_of("finger", model)
    write_usd_target(tmp_path, mechanism, model)
    meant = correct(mechanism, replace(model, bench_overrides={})).corrected
    builder = newton.ModelBuilder()
    readers = [SchemaResolverNewton(), *(other() for other in others)]
    builder.add_usd(str(tmp_path / BENCH_FILE), schema_resolvers=readers)
    assert builder.joint_friction == pytest.approx([j.friction for j in meant.joints], rel=1e-6)
    assert builder.joint_damping == pytest.approx([j.damping for j in meant.joints], rel=1e-6)
    assert min(builder.joint_friction) > 0.0


def test_the_file_stands_alone(tmp_path: Path) -> None:
    """It names no other file."""
    model = model_of("thumb", "ideal", "joint_damping_error")
    write_usd_target(tmp_path, bench_of("thumb", model), model)
    text = (tmp_path / BENCH_FILE).read_text(encoding="utf-8")
    assert "subLayers" not in text
    assert "@" not in text


def test_our_solver_on_the_file_is_our_solver(tmp_path: Path) -> None:
    """With the rest of the model it moves as the asset does with all of it."""
    effects = ("joint_stiffness_error", "gravity_misalignment", "spool_radius_error")
    found = strays(tmp_path, "usd", WAY, "finger", "ideal", *effects)
    assert found.angle < 0.1 * ANGLE
    assert found.force < 0.1 * FORCE
