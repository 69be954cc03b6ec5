"""Joints and links as URDF: what weighs, where, and about which axes."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tendon_newton.exports.arms.urdf_arm import robot_text
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec
from tendon_newton.mechanisms.loading import load_mechanism


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
def test_the_links_weigh_and_turn_as_those_of_the_asset(bench: str, tmp_path: Path) -> None:
    """Mass matrices agree in three postures: masses, inertias, places and axes are right."""
    mechanism = load_mechanism(bench)
    joints, names = mechanism.joints, mechanism.joint_names
    (tmp_path / "a.urdf").write_text(robot_text(bench, joints, [1.0] * len(joints)))
    ours = mujoco_spec(mechanism).compile()
    theirs = mujoco.MjModel.from_xml_path(str(tmp_path / "a.urdf"))
    rng = np.random.default_rng(0)
    for _ in range(3):
        q = rng.uniform(0.0, 1.0, len(joints))
        a, b = inertia_of(ours, names, q), inertia_of(theirs, names, q)
        assert a == pytest.approx(b, rel=1e-4, abs=1e-4 * np.abs(a).max())  # float32 in USD
    damping = [theirs.dof_damping[theirs.joint(n).dofadr[0]] for n in names]
    assert damping == pytest.approx([joint.damping for joint in joints], rel=1e-6)


def test_a_link_whose_frame_is_turned_weighs_where_it_did() -> None:
    """Its centre and its inertia, turned back from the joint's frame, are the body's own."""
    turn = Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_matrix()
    first = replace(load_mechanism("finger").joints[0], child_rotation=turn)
    inertial = ET.fromstring(robot_text("finger", [first], [1.0])).findall("link/inertial")[0]
    origin, tensor = inertial.find("origin"), inertial.find("inertia")
    assert origin is not None
    assert tensor is not None
    centre = np.array([float(x) for x in origin.attrib["xyz"].split()])
    assert turn @ centre + first.child_position == pytest.approx(first.center_of_mass, abs=1e-9)
    own = {name: float(value) for name, value in tensor.attrib.items()}
    rows = [[own["".join(("i", *sorted(a + b)))] for b in "xyz"] for a in "xyz"]
    assert turn @ np.array(rows) @ turn.T == pytest.approx(first.inertia, abs=1e-12)
