"""A link of a URDF weighs where the bench has it, however its frame is turned."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tendon_newton.exports.urdf_target import ROBOT_FILE, write_urdf_target
from tendon_newton.simulation.hosts.replay import bench_of
from tests.physics.runs import ideal_model


def test_a_link_whose_frame_is_turned_weighs_where_it_did(tmp_path: Path) -> None:
    """Its centre and its inertia, turned back from the joint's frame, are the body's own."""
    model = ideal_model()
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
