"""One line of the finger spoiled at a time, or several: each fault has its named finding."""

from contextlib import nullcontext
from pathlib import Path
from time import process_time

import pytest

from tendon_hardware.servos import SERVOS
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.flat_assets import two_strings, write_changed

LIMIT = 10.0  # A check takes less of a core [s], whatever the asset holds
PIP = "/finger/joints/pip"
DIP = "/finger/joints/dip"
MIDDLE = "/finger/middle_phalanx"
DISTAL = "/finger/distal_phalanx"
FLEXOR = "/finger/tendons/flexor"
MASS = "float physics:mass = 0.012"
INERTIA = "float3 physics:diagonalInertia = (9.6e-8, 9e-7, 9e-7)"
CENTER = "point3f physics:centerOfMass = (0.015, 0, 0)"
SPRING = "uniform double mjc:stiffness = 0.045"
DAMPING = "float newton:damping = 0.000008726646"
LOCAL = "point3f physics:localPos0 = (0.03, 0, 0)"
UPPER = "float physics:upperLimit = 100.26762"
COEF = "uniform double[] mjc:path:coef = [0.008, 0.0055]"
SPOOL = "double tendon:spoolRadius = 0.0125"
BODY0 = "rel physics:body0 = </finger/middle_phalanx>"
AXIS = f'uniform token physics:axis = "Y"\n            {BODY0}'
TIP = "double3 xformOp:translate = (0.025, 0, 0)"
BODY1 = "rel physics:body1 = </finger/distal_phalanx>"
STOP = "float newton:limitStiffness = 0.5235988"
GRAVITY = "float physics:gravityMagnitude = 9.81"
PATH = (
    "rel mjc:path = [\n                </finger/joints/pip>,\n"
    "                </finger/joints/dip>,\n            ]"
)
DIP_IN_PATH = "                </finger/joints/dip>,\n"
LOOSE = (
    'def Xform "loose" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])\n{\n'
    "float physics:mass = 0.1\npoint3f physics:centerOfMass = (0, 0, 0)\n"
    "float3 physics:diagonalInertia = (1e-5, 1e-5, 1e-5)\n}\n"
)
Change = tuple[str, str]
Fault = tuple[str, str, str, tuple[Change, ...]]


def fault(rule: str, prim: str, *changes: Change, severity: str = "error") -> Fault:
    """Return which rule tells which prim, how badly, after changes of the flattened finger."""
    return rule, prim, severity, changes


CASES: dict[str, Fault] = {
    "a word for a mass": fault("attribute", MIDDLE, (MASS, 'string physics:mass = "x"')),
    "a mass that is none": fault("attribute", MIDDLE, (MASS, "float physics:mass = nan")),
    "an endless mass": fault("attribute", MIDDLE, (MASS, "float physics:mass = inf")),
    "a word for a spring": fault("attribute", PIP,
        (SPRING, 'uniform token mjc:stiffness = "soft"')),
    "a spring that is none": fault("attribute", PIP, (SPRING, SPRING[:-5] + "nan")),
    "three numbers for a limit": fault("attribute", PIP,
        (UPPER, "double3 physics:upperLimit = (1, 2, 3)")),
    "one moment arm without brackets": fault("attribute", FLEXOR,
        (COEF, "uniform double mjc:path:coef = 0.008")),
    "a moment arm that is none": fault("attribute", FLEXOR, (COEF, COEF.replace("0.008", "nan"))),
    "a word for a spool": fault("attribute", FLEXOR, (SPOOL, 'string tendon:spoolRadius = "x"')),
    "a number for a type": fault("attribute", FLEXOR,
        ('uniform token mjc:type = "fixed"', "double mjc:type = 3")),
    "an unknown type": fault("attribute", FLEXOR, ('mjc:type = "fixed"', 'mjc:type = "elastic"')),
    "a diagonal axis": fault("attribute", PIP, ('physics:axis = "Y"', 'physics:axis = "XY"')),
    "a word for a switch": fault("attribute", FLEXOR,
        ("bool tendon:direct = 0", 'string tendon:direct = "no"')),
    "two numbers for a centre of mass":
        fault("attribute", MIDDLE, (CENTER, "double2 physics:centerOfMass = (0.01, 0)")),
    "a list for an inertia": fault("attribute", MIDDLE,
        (INERTIA, "double[] physics:diagonalInertia = [1e-6]")),
    "no mass schema": fault("mass", MIDDLE,
        ('apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]',
        'apiSchemas = ["PhysicsRigidBodyAPI"]')),
    "a mass of micrograms": fault("mass", MIDDLE, (MASS, "float physics:mass = 1e-6"),
        severity="warning"),
    "an inertia in g mm^2": fault("inertia", MIDDLE,
        (INERTIA, INERTIA.replace("(9.6e-8, 9e-7, 9e-7)", "(90, 900, 900)")), severity="warning"),
    "an inertia ten times as great": fault("inertia", MIDDLE,
        (INERTIA, INERTIA.replace("(9.6e-8, 9e-7, 9e-7)", "(9.6e-7, 9e-6, 9e-6)")),
        severity="warning"),
    "no inertia": fault("inertia", MIDDLE, (INERTIA, "")),
    "a negative inertia": fault("inertia", MIDDLE, (INERTIA, INERTIA.replace("9e-7)", "-9e-7)"))),
    "axes that turn nothing": fault("inertia", MIDDLE,
        ("quatf physics:principalAxes = (1, 0, 0, 0)",
        "quatf physics:principalAxes = (0, 0, 0, 0)")),
    "no centre of mass": fault("center_of_mass", MIDDLE, (CENTER, ""), severity="warning"),
    "a centre of mass in millimetres": fault("center_of_mass", MIDDLE,
        (CENTER, CENTER.replace("0.015", "15")), severity="warning"),
    "a centre of mass beside its link": fault("center_of_mass", MIDDLE,
        (CENTER, CENTER.replace("0.015, 0, 0", "0.015, 0.02, 0")), severity="warning"),
    "a tip ten times as far": fault("tip", f"{DISTAL}/tip", (TIP, TIP.replace("0.025", "0.25")),
        severity="warning"),
    "a joint that twists": fault("joint_axis", DIP, (AXIS, AXIS.replace('"Y"', '"X"')),
        severity="warning"),
    "a joint that bends sideways": fault("joint_axis", DIP, (AXIS, AXIS.replace('"Y"', '"Z"')),
        severity="warning"),
    "a servo that nobody knows": fault("tendon_drive", FLEXOR, ("xc330-t288-t", "xc331-t288-t"),
        severity="warning"),
    "no gravity": fault("gravity", "/", ('def PhysicsScene "scene"', 'def Scope "scene"'),
        severity="warning"),
    "gravity in cm/s^2": fault("gravity", "/finger/scene",
        (GRAVITY, GRAVITY.replace("9.81", "981")), severity="warning"),
    "gravity of nothing": fault("gravity", "/finger/scene",
        (GRAVITY, GRAVITY.replace("9.81", "0")), severity="warning"),
    "a tip that is no site": fault("tip", f"{DISTAL}/tip",
        ('apiSchemas = ["MjcSiteAPI"]', 'kind = "component"'), severity="warning"),
    "no tip": fault("tip", "/", ('def Sphere "tip"', 'def Sphere "end"'), severity="note"),
    "a joint on itself": fault("chain", DIP, (BODY0, BODY0.replace("middle", "distal"))),
    "a link moved twice": fault("chain", DIP, (BODY1, BODY1.replace("distal", "middle"))),
    "a link that nothing holds": fault("chain", DISTAL, (BODY1, BODY1.replace("distal", "middle"))),
    "a loose link": fault("chain", "/finger/loose",
        ('def Scope "joints"', LOOSE + 'def Scope "joints"')),
    "a chain that bites its tail": fault("chain", PIP,
        ("rel physics:body0 = </finger/base>", "rel physics:body0 = </finger/distal_phalanx>")),
    "a joint without a link": fault("joint_body", DIP, (BODY1, "")),
    "a joint of a shape": fault("joint_body", DIP,
        (BODY1, "rel physics:body1 = </finger/base/block>"),
        (BODY0, "rel physics:body0 = </finger/base>")),
    "no joints": fault("joint", "/", ("def PhysicsRevoluteJoint", "def Scope")),
    "a ball joint": fault("joint_type", DIP, ('RevoluteJoint "dip"', 'SphericalJoint "dip"')),
    "a joint of six": fault("joint_type", DIP,
        ('PhysicsRevoluteJoint "dip"', 'PhysicsJoint "dip"')),
    "a joint beside its link": fault("joint_frame", DIP, (LOCAL, LOCAL.replace("0.03", "0.04")),
        severity="warning"),
    "a joint in millimetres": fault("joint_frame", DIP, (LOCAL, LOCAL.replace("0.03", "30")),
        severity="warning"),
    "a range in radians": fault("limits", PIP, (UPPER, UPPER.replace("100.26762", "1.75")),
        severity="warning"),
    "a range of turns": fault("limits", PIP, (UPPER, UPPER.replace("100.26762", "1002.6762")),
        severity="warning"),
    "an endless range": fault("limits", PIP, (UPPER, "float physics:upperLimit = inf")),
    "a range of nothing": fault("limits", PIP, (UPPER, "float physics:upperLimit = 0")),
    "a spring in N mm": fault("spring", PIP, (SPRING, SPRING.replace("0.045", "45")),
        severity="warning"),
    "no spring reference": fault("springref", PIP, ("uniform double mjc:springref = 0", ""),
        severity="warning"),
    "a damping per radian": fault("damping", PIP, (DAMPING, "float newton:damping = 5e-4"),
        severity="warning"),
    "a damping that drives": fault("damping", PIP, (DAMPING, "float newton:damping = -1e-5")),
    "a friction that drives": fault("damping", PIP,
        ("float newton:friction = 0", "float newton:friction = -1")),
    "no end stop": fault("stop", PIP, (STOP, ""), severity="warning"),
    "an end stop of nothing": fault("stop", PIP, (STOP, "float newton:limitStiffness = 0")),
    "an end stop of steel": fault("stop", PIP, (STOP, "float newton:limitStiffness = 1e5"),
        severity="warning"),
    "a stop that drives": fault("stop", PIP,
        ("float newton:limitDamping = 0.00034906584", "float newton:limitDamping = -1")),
    "a tendon without a path": fault("tendon_path", FLEXOR, (PATH, "")),
    "a path of numbers": fault("tendon_path", FLEXOR,
        ("rel mjc:path = [", "double[] mjc:path = [1]\n rel other = [")),
    "a tendon to a link": fault("tendon_path", FLEXOR,
        ("</finger/joints/dip>,", "</finger/distal_phalanx>,")),
    "too many moment arms": fault("tendon_coef", FLEXOR,
        (COEF, COEF.replace("0.0055]", "0.0055, 0.001]"))),
    "indices that repeat": fault("tendon_path", FLEXOR,
        (COEF, f"{COEF}\nuniform int[] mjc:path:indices = [0, 0]")),
    "a moment arm of zero": fault("moment_arm_sign", FLEXOR, (COEF, COEF.replace("0.0055", "0")),
        severity="warning"),
    "arms that only open": fault("moment_arm_sign", FLEXOR,
        (COEF, COEF.replace("0.008", "-0.008").replace("0.0055", "-0.0055")), severity="warning"),
    "a servo of nothing": fault("tendon_drive", FLEXOR,
        ("tendon:forceLimit = 21", "tendon:forceLimit = 0")),
    "a servo too weak": fault("closing_force", FLEXOR,
        ("tendon:forceLimit = 21", "tendon:forceLimit = 0.5")),
    "a spool in millimetres": fault("spool", FLEXOR, (SPOOL, "double tendon:spoolRadius = 12.5"),
        severity="warning"),
    "a spool ten times as great": fault("tendon_drive", FLEXOR,
        (SPOOL, "double tendon:spoolRadius = 0.125"), severity="warning"),
    "a pull in millinewtons": fault("tendon_drive", FLEXOR,
        ("tendon:forceLimit = 21", "tendon:forceLimit = 21000"), severity="warning"),
    "a spool for a watch": fault("spool", FLEXOR, (SPOOL, "double tendon:spoolRadius = 0.001"),
        severity="warning"),
    "springs too soft to open": fault("slack", FLEXOR, (SPRING, SPRING.replace("0.045", "0.003")),
        ("mjc:stiffness = 0.03", "mjc:stiffness = 0.002"), severity="note"),
    "springs that close": fault("slack", FLEXOR, ("mjc:springref = 0", "mjc:springref = 75"),
        severity="warning"),
    "no mass": fault("mass", MIDDLE, (MASS, "float physics:mass = 0")),
    "a mass in grams": fault("mass", MIDDLE, (MASS, "float physics:mass = 12"), severity="warning"),
    "an inertia of no body": fault("inertia", MIDDLE, (INERTIA, INERTIA.replace("9e-7)", "9e-6)"))),
    "millimetres": fault("units", "/", ("metersPerUnit = 1", "metersPerUnit = 0.001")),
    "grams": fault("units", "/", ("kilogramsPerUnit = 1", "kilogramsPerUnit = 0.001")),
    "y up": fault("up_axis", "/", ('upAxis = "Z"', 'upAxis = "Y"')),
    "no root prim": fault("default_prim", "/", ('defaultPrim = "finger"', "")),
    "a joint to a missing prim": fault("joint_body", DIP, (BODY1, BODY1.replace("distal", "no"))),
    "a missing limit": fault("limits", PIP, (UPPER, "float other = 100")),
    "limits in the wrong order": fault("limits", PIP, (UPPER, "float physics:upperLimit = -1")),
    "no spring": fault("spring", PIP, (SPRING, "double other = 0"), severity="warning"),
    "a spring that pushes": fault("spring", PIP, (SPRING, SPRING.replace("0.045", "-0.045"))),
    "a spring that is relaxed when closed": fault("springref", PIP,
        ("mjc:springref = 0", "mjc:springref = 120"), severity="warning"),
    "no tendon": fault("tendon", "/", ("def MjcTendon", "def Scope")),
    "a tendon to a missing joint": fault("tendon_path", FLEXOR,
        (DIP_IN_PATH, "</finger/joints/x>,\n")),
    "a routed tendon through joints": fault("tendon_type", FLEXOR,
        ('mjc:type = "fixed"', 'mjc:type = "spatial"')),
    "too few moment arms": fault("tendon_coef", FLEXOR, (COEF, COEF.replace(", 0.0055]", "]"))),
    "a moment arm in millimetres": fault("moment_arm", FLEXOR, (COEF, COEF.replace("0.008", "8")),
        severity="warning"),
    "an arm that opens": fault("moment_arm_sign", FLEXOR, (COEF, COEF.replace("0.0055", "-0.0055")),
        severity="warning"),
    "a spool of no size": fault("tendon_drive", FLEXOR, (SPOOL, "double tendon:spoolRadius = 0")),
    "no spool": fault("tendon_drive", FLEXOR, (SPOOL, "double other = 0.0125"), severity="warning"),
}  # fmt: skip


def spoiled(folder: Path, case: str) -> Path:
    """Write the finger with the changes of a case."""
    return write_changed(folder, "finger", *CASES[case][3])


@pytest.mark.parametrize("case", CASES)
def test_a_fault_is_named_with_its_prim_and_its_remedy(case: str, tmp_path: Path) -> None:
    """Rule, severity and prim are those of the fault; only an error keeps it from loading."""
    rule, prim, severity, _ = CASES[case]
    path = spoiled(tmp_path, case)
    began = process_time()
    findings = check_asset(path, SERVOS)
    assert process_time() - began < LIMIT
    assert (rule, prim, severity) in {(f.rule, f.prim, f.severity) for f in findings}
    assert all(f.message and f.remedy and not f.message.endswith(".") for f in findings)
    refused = severity == "error" and rule != "closing_force"
    with pytest.raises(InvalidAsset) if refused else nullcontext():
        load_mechanism(path)


def test_a_joint_that_spreads_to_both_sides_is_no_mistake(tmp_path: Path) -> None:
    """It turns about z, from -20 to 20 degrees, as the first of a hand's fingers may."""
    ends = "float physics:lowerLimit = {}\n            float physics:upperLimit = {}"
    both = ends.format(0, "80.21409"), ends.format(-20, "20.0")
    path = write_changed(tmp_path, "finger", (AXIS, AXIS.replace('"Y"', '"Z"')), both)
    assert not [finding for finding in check_asset(path) if finding.rule == "joint_axis"]


def test_a_string_may_open_what_another_one_closes(tmp_path: Path) -> None:
    """An extensor beside its flexor is sound; alone it is the sign that slipped."""
    assert not [f for f in check_asset(two_strings(tmp_path)) if f.rule == "moment_arm_sign"]


def test_an_index_into_nothing_is_told_of_the_string_that_has_it(tmp_path: Path) -> None:
    """The other string's arms are judged beside it: its check does not stop at the index."""
    path = two_strings(tmp_path)
    before, extensor = path.read_text().split('"extensor"')
    places = "uniform int[] mjc:path:indices = [0, 9]\nuniform double[] mjc:path:coef"
    path.write_text(
        f'{before}"extensor"{extensor.replace("uniform double[] mjc:path:coef", places)}'
    )
    (found,) = check_asset(path)
    assert (found.rule, found.prim) == ("tendon_path", "/finger/tendons/extensor")


def test_several_faults_are_named_at_once(tmp_path: Path) -> None:
    """One run of the check lists them all: mending is one round, not seven."""
    several = (
        "a mass of micrograms", "a range in radians", "a servo of nothing", "no end stop",
        "a damping that drives", "too many moment arms", "gravity in cm/s^2",
    )  # fmt: skip
    changes = [change for case in several for change in CASES[case][3]]
    found = {(f.rule, f.prim) for f in check_asset(write_changed(tmp_path, "finger", *changes))}
    assert {CASES[case][:2] for case in several} <= found


def test_an_arm_that_skips_the_joint_between_is_named(tmp_path: Path) -> None:
    """A tendon on the first and the third of three joints passes the second."""
    third = (
        'def PhysicsRevoluteJoint "third" (apiSchemas = ["NewtonJointAPI"])\n{\n'
        "rel physics:body0 = </finger/distal_phalanx>\nrel physics:body1 = </finger/loose>\n"
        'uniform token physics:axis = "Y"\n}\ndef PhysicsRevoluteJoint "dip"'
    )
    path = write_changed(
        tmp_path,
        "finger",
        ('def Scope "joints"', LOOSE + 'def Scope "joints"'),
        ('def PhysicsRevoluteJoint "dip"', third),
        (DIP_IN_PATH, DIP_IN_PATH.replace("dip", "third")),
    )
    (finding,) = [f for f in check_asset(path) if f.rule == "tendon_path"]
    assert finding.message.startswith("a tendon that passes /finger/joints/dip")
