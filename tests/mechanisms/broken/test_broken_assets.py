"""Assets that are not found or not whole, and strange ones that are sound."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.errors import InvalidAsset, UnknownName
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tests.mechanisms.broken.flat_assets import write_changed


def test_servo_too_weak_for_the_whole_range_is_worth_a_note() -> None:
    """The strong spring closes at 64 N; 21 N reach a third of its range."""
    (note,) = check_asset("spring_strong")
    assert note.severity == "note"
    assert "33 %" in note.message


def test_unknown_asset_lists_the_known_ones() -> None:
    """A name outside assets/ is answered with the names inside."""
    with pytest.raises(UnknownName, match="hand, hand_ball, hand_pen, pendulum"):
        asset_path("fingre")
    with pytest.raises(UnknownName, match="No asset named"):
        asset_path(5000 * "x")  # longer than a file's name can be


def test_a_path_that_is_no_asset_says_what_was_there(tmp_path: Path) -> None:
    """A folder of something else, and one that is not there, were called unknown names."""
    with pytest.raises(InvalidAsset, match=f"{tmp_path.name}.usda in it; this is neither"):
        asset_path(tmp_path)
    with pytest.raises(InvalidAsset, match="no such file or folder"):
        asset_path(tmp_path / "finger")


def test_missing_layer_is_a_composition_error(tmp_path: Path) -> None:
    """An interface copied without its layers says which layer is missing."""
    path = tmp_path / "finger.usda"
    path.write_text(asset_path("finger").read_text())
    assert "composition" in {f.rule for f in check_asset(path)}
    with pytest.raises(InvalidAsset, match=r"tendon\.usda"):
        load_mechanism(path)


def test_base_on_a_fixed_joint_is_merged_away(tmp_path: Path) -> None:
    """A rigid base held by a fixed joint adds no degree of freedom and no body."""
    base = (
        'def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])\n{\n'
        "float physics:mass = 0.1\nfloat3 physics:diagonalInertia = (1e-5, 1e-5, 1e-5)\n"
        "quatf physics:principalAxes = (1, 0, 0, 0)\n"
    )
    fixed = (
        'def PhysicsFixedJoint "ground"\n{\nrel physics:body1 = </finger/base>\n}\n'
        'def PhysicsRevoluteJoint "pip"'
    )
    path = write_changed(
        tmp_path,
        "finger",
        ('def Xform "base"\n    {\n', base),
        ('def PhysicsRevoluteJoint "pip"', fixed),
    )
    held, nominal = load_mechanism(path), load_mechanism("finger")
    assert held.joint_names == nominal.joint_names
    assert [j.mass for j in held.joints] == [j.mass for j in nominal.joints]
    assert np.array_equal(held.tendons[0].moment_arm, nominal.tendons[0].moment_arm)


def test_two_tendons_become_two_rows(tmp_path: Path) -> None:
    """An opening tendon beside the closing one has its own row and its own arms."""
    second = (
        'def MjcTendon "extensor"\n{\nuniform token mjc:type = "fixed"\n'
        "rel mjc:path = [</finger/joints/pip>]\nuniform double[] mjc:path:coef = [-0.006]\n"
        "double tendon:spoolRadius = 0.010\ndouble tendon:forceLimit = 10\n}\n"
        'def MjcTendon "flexor"'
    )
    path = write_changed(tmp_path, "finger", ('def MjcTendon "flexor"', second))
    mechanism = load_mechanism(path)
    assert [tendon.name for tendon in mechanism.tendons] == ["extensor", "flexor"]
    rows = build_model(mechanism, 2, device="cpu").tendon
    assert rows.arm_tendon.numpy().tolist() == [0, 1, 1, 2, 3, 3]
    assert rows.arm_joint.numpy().tolist() == [0, 0, 1, 2, 2, 3]
    assert rows.spool_radius.numpy() == pytest.approx([0.010, 0.0125] * 2)
    assert mechanism.tendons[0].moment_arm == pytest.approx([-0.006, 0.0])
