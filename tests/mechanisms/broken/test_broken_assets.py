"""Assets with one thing wrong: each gives a named finding or a clear error."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.errors import InvalidAsset, UnknownName
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tests.mechanisms.broken.flat_assets import write_changed

PIP_BODY = "rel physics:body1 = </finger/middle_phalanx>"
ERRORS: dict[str, tuple[str, tuple[str, str]]] = {
    "negative mass": ("mass", ("physics:mass = 0.012", "physics:mass = -0.012")),
    "no mass": ("mass", ("physics:mass = 0.012", "physics:mass = 0")),
    "impossible inertia": ("inertia", ("(9.6e-8, 9e-7, 9e-7)", "(9.6e-8, 9e-7, 9e-6)")),
    "joint to a missing prim": ("joint_body", (PIP_BODY, PIP_BODY.replace("middle", "no"))),
    "tendon to a missing joint": ("tendon_path", ("</finger/joints/dip>,", "</finger/joints/x>,")),
    "too few moment arms": ("tendon_coef", ("coef = [0.008, 0.0055]", "coef = [0.008]")),
    "routed tendon": ("tendon_type", ('mjc:type = "fixed"', 'mjc:type = "spatial"')),
    "millimetres": ("units", ("metersPerUnit = 1", "metersPerUnit = 0.001")),
    "grams": ("units", ("kilogramsPerUnit = 1", "kilogramsPerUnit = 0.001")),
    "y up": ("up_axis", ('upAxis = "Z"', 'upAxis = "Y"')),
    "no root prim": ("default_prim", ('defaultPrim = "finger"', "")),
    "missing limit": ("limits", ("float physics:upperLimit = 80.21409", "float other = 80")),
    "limits in the wrong order": (
        "limits",
        ("physics:upperLimit = 80.21409", "physics:upperLimit = -1"),
    ),
    "no tendon": ("tendon", ("def MjcTendon", "def Scope")),
    "spool of no size": ("tendon_drive", ("spoolRadius = 0.0125", "spoolRadius = 0")),
    "spring that pushes": ("spring", ("mjc:stiffness = 0.045", "mjc:stiffness = -0.045")),
}
WARNINGS: dict[str, tuple[str, tuple[str, str]]] = {
    "mass in grams": ("mass", ("physics:mass = 0.012", "physics:mass = 12")),
    "moment arm in millimetres": ("moment_arm", ("[0.008, 0.0055]", "[8, 0.0055]")),
    "opening moment arm": ("moment_arm_sign", ("[0.008, 0.0055]", "[0.008, -0.0055]")),
    "no spring": ("spring", ("uniform double mjc:stiffness = 0.03", "double other = 0")),
    "spring relaxed when closed": ("springref", ("mjc:springref = 0", "mjc:springref = 120")),
    "spool too thin": ("spool", ("spoolRadius = 0.0125", "spoolRadius = 0.001")),
    "no spool radius": ("tendon_drive", ("double tendon:spoolRadius", "double other")),
}


@pytest.mark.parametrize("case", [*ERRORS, *WARNINGS])
def test_broken_asset_has_a_named_finding(case: str, tmp_path: Path) -> None:
    """The check names the rule; loading refuses an error, and lets a warning be."""
    severity = "error" if case in ERRORS else "warning"
    rule, change = (ERRORS | WARNINGS)[case]
    path = write_changed(tmp_path, "finger", change)
    assert rule in {f.rule for f in check_asset(path) if f.severity == severity}
    with pytest.raises(InvalidAsset) if severity == "error" else nullcontext():
        load_mechanism(path)


def test_servo_too_weak_to_close_is_an_error_below_a_tenth(tmp_path: Path) -> None:
    """21 N against 20 kN/m move the slider by 1 % of its range."""
    path = write_changed(tmp_path, "spring_weak", ("mjc:stiffness = 200", "mjc:stiffness = 20000"))
    assert ("closing_force", "error") in {(f.rule, f.severity) for f in check_asset(path)}


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


def test_missing_layer_is_a_composition_error(tmp_path: Path) -> None:
    """An interface copied without its layers says which layer is missing."""
    path = tmp_path / "finger.usda"
    path.write_text(asset_path("finger").read_text())
    assert "composition" in {f.rule for f in check_asset(path)}
    with pytest.raises(InvalidAsset, match=r"tendon\.usda"):
        load_mechanism(path)


def test_ball_joint_is_refused_by_name(tmp_path: Path) -> None:
    """Only joints with one degree of freedom can carry a moment arm."""
    path = write_changed(
        tmp_path, "finger", ('def PhysicsRevoluteJoint "dip"', 'def PhysicsSphericalJoint "dip"')
    )
    with pytest.raises(InvalidAsset, match="dip"):
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
