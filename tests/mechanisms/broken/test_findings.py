"""One line of the finger spoiled at a time, or several: each fault has its named finding."""

from pathlib import Path
from time import process_time

import pytest

from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.flat_assets import write_changed

LIMIT = 10.0
"""A check takes less of a core [s], whatever the asset holds."""
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

# what is wrong -> rule, prim, severity, changes of the flattened finger
CASES: dict[str, tuple[str, str, str, tuple[Change, ...]]] = {
    "a word for a mass": ("attribute", MIDDLE, "error", ((MASS, 'string physics:mass = "x"'),)),
    "a mass that is none": ("attribute", MIDDLE, "error", ((MASS, "float physics:mass = nan"),)),
    "an endless mass": ("attribute", MIDDLE, "error", ((MASS, "float physics:mass = inf"),)),
    "a word for a spring": (
        "attribute",
        PIP,
        "error",
        ((SPRING, 'uniform token mjc:stiffness = "soft"'),),
    ),
    "a spring that is none": ("attribute", PIP, "error", ((SPRING, SPRING[:-5] + "nan"),)),
    "three numbers for a limit": (
        "attribute",
        PIP,
        "error",
        ((UPPER, "double3 physics:upperLimit = (1, 2, 3)"),),
    ),
    "one moment arm without brackets": (
        "attribute",
        FLEXOR,
        "error",
        ((COEF, "uniform double mjc:path:coef = 0.008"),),
    ),
    "a moment arm that is none": (
        "attribute",
        FLEXOR,
        "error",
        ((COEF, COEF.replace("0.008", "nan")),),
    ),
    "a word for a spool": (
        "attribute",
        FLEXOR,
        "error",
        ((SPOOL, 'string tendon:spoolRadius = "x"'),),
    ),
    "a number for a type": (
        "attribute",
        FLEXOR,
        "error",
        (('uniform token mjc:type = "fixed"', "double mjc:type = 3"),),
    ),
    "an unknown type": (
        "attribute",
        FLEXOR,
        "error",
        (('mjc:type = "fixed"', 'mjc:type = "elastic"'),),
    ),
    "a diagonal axis": (
        "attribute",
        PIP,
        "error",
        (('physics:axis = "Y"', 'physics:axis = "XY"'),),
    ),
    "a word for a switch": (
        "attribute",
        FLEXOR,
        "error",
        (("bool tendon:direct = 0", 'string tendon:direct = "no"'),),
    ),
    "two numbers for a centre of mass": (
        "attribute",
        MIDDLE,
        "error",
        ((CENTER, "double2 physics:centerOfMass = (0.01, 0)"),),
    ),
    "a list for an inertia": (
        "attribute",
        MIDDLE,
        "error",
        ((INERTIA, "double[] physics:diagonalInertia = [1e-6]"),),
    ),
    "no mass schema": (
        "mass",
        MIDDLE,
        "error",
        (
            (
                'apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]',
                'apiSchemas = ["PhysicsRigidBodyAPI"]',
            ),
        ),
    ),
    "a mass of micrograms": ("mass", MIDDLE, "warning", ((MASS, "float physics:mass = 1e-6"),)),
    "an inertia in g mm^2": (
        "inertia",
        MIDDLE,
        "warning",
        ((INERTIA, INERTIA.replace("(9.6e-8, 9e-7, 9e-7)", "(90, 900, 900)")),),
    ),
    "no inertia": ("inertia", MIDDLE, "error", ((INERTIA, ""),)),
    "a negative inertia": (
        "inertia",
        MIDDLE,
        "error",
        ((INERTIA, INERTIA.replace("9e-7)", "-9e-7)")),),
    ),
    "axes that turn nothing": (
        "inertia",
        MIDDLE,
        "error",
        (
            (
                "quatf physics:principalAxes = (1, 0, 0, 0)",
                "quatf physics:principalAxes = (0, 0, 0, 0)",
            ),
        ),
    ),
    "no centre of mass": ("center_of_mass", MIDDLE, "warning", ((CENTER, ""),)),
    "a centre of mass in millimetres": (
        "center_of_mass",
        MIDDLE,
        "warning",
        ((CENTER, CENTER.replace("0.015", "15")),),
    ),
    "no gravity": ("gravity", "/", "warning", (('def PhysicsScene "scene"', 'def Scope "scene"'),)),
    "gravity in cm/s^2": (
        "gravity",
        "/finger/scene",
        "warning",
        ((GRAVITY, GRAVITY.replace("9.81", "981")),),
    ),
    "a tip that is no site": (
        "tip",
        f"{DISTAL}/tip",
        "warning",
        (('apiSchemas = ["MjcSiteAPI"]', 'kind = "component"'),),
    ),
    "no tip": ("tip", "/", "note", (('def Sphere "tip"', 'def Sphere "end"'),)),
    "a joint on itself": ("chain", DIP, "error", ((BODY0, BODY0.replace("middle", "distal")),)),
    "a link moved twice": ("chain", DIP, "error", ((BODY1, BODY1.replace("distal", "middle")),)),
    "a link that nothing holds": (
        "chain",
        DISTAL,
        "error",
        ((BODY1, BODY1.replace("distal", "middle")),),
    ),
    "a loose link": (
        "chain",
        "/finger/loose",
        "error",
        (('def Scope "joints"', LOOSE + 'def Scope "joints"'),),
    ),
    "a chain that bites its tail": (
        "chain",
        PIP,
        "error",
        (("rel physics:body0 = </finger/base>", "rel physics:body0 = </finger/distal_phalanx>"),),
    ),
    "a joint without a link": ("joint_body", DIP, "error", ((BODY1, ""),)),
    "a joint of a shape": (
        "joint_body",
        DIP,
        "error",
        (
            (BODY1, "rel physics:body1 = </finger/base/block>"),
            (BODY0, "rel physics:body0 = </finger/base>"),
        ),
    ),
    "no joints": (
        "joint",
        "/",
        "error",
        (("def PhysicsRevoluteJoint", "def Scope"),),
    ),
    "a ball joint": (
        "joint_type",
        DIP,
        "error",
        (('RevoluteJoint "dip"', 'SphericalJoint "dip"'),),
    ),
    "a joint of six": (
        "joint_type",
        DIP,
        "error",
        (('PhysicsRevoluteJoint "dip"', 'PhysicsJoint "dip"'),),
    ),
    "a joint beside its link": (
        "joint_frame",
        DIP,
        "warning",
        ((LOCAL, LOCAL.replace("0.03", "0.04")),),
    ),
    "a joint in millimetres": (
        "joint_frame",
        DIP,
        "warning",
        ((LOCAL, LOCAL.replace("0.03", "30")),),
    ),
    "a range in radians": (
        "limits",
        PIP,
        "warning",
        ((UPPER, UPPER.replace("100.26762", "1.75")),),
    ),
    "an endless range": ("limits", PIP, "error", ((UPPER, "float physics:upperLimit = inf"),)),
    "a range of nothing": ("limits", PIP, "error", ((UPPER, "float physics:upperLimit = 0"),)),
    "a spring in N mm": ("spring", PIP, "warning", ((SPRING, SPRING.replace("0.045", "45")),)),
    "no spring reference": (
        "springref",
        PIP,
        "warning",
        (("uniform double mjc:springref = 0", ""),),
    ),
    "a damping per radian": (
        "damping",
        PIP,
        "warning",
        ((DAMPING, "float newton:damping = 5e-4"),),
    ),
    "a damping that drives": (
        "damping",
        PIP,
        "error",
        ((DAMPING, "float newton:damping = -1e-5"),),
    ),
    "a friction that drives": (
        "damping",
        PIP,
        "error",
        (("float newton:friction = 0", "float newton:friction = -1"),),
    ),
    "no end stop": ("stop", PIP, "warning", ((STOP, ""),)),
    "an end stop of nothing": ("stop", PIP, "error", ((STOP, "float newton:limitStiffness = 0"),)),
    "an end stop of steel": (
        "stop",
        PIP,
        "warning",
        ((STOP, "float newton:limitStiffness = 1e5"),),
    ),
    "a stop that drives": (
        "stop",
        PIP,
        "error",
        (("float newton:limitDamping = 0.00034906584", "float newton:limitDamping = -1"),),
    ),
    "a tendon without a path": (
        "tendon_path",
        FLEXOR,
        "error",
        ((PATH, ""),),
    ),
    "a path of numbers": (
        "tendon_path",
        FLEXOR,
        "error",
        (("rel mjc:path = [", "double[] mjc:path = [1]\n rel other = ["),),
    ),
    "a tendon to a link": (
        "tendon_path",
        FLEXOR,
        "error",
        (("</finger/joints/dip>,", "</finger/distal_phalanx>,"),),
    ),
    "too many moment arms": (
        "tendon_coef",
        FLEXOR,
        "error",
        ((COEF, COEF.replace("0.0055]", "0.0055, 0.001]")),),
    ),
    "indices that repeat": (
        "tendon_path",
        FLEXOR,
        "error",
        ((COEF, f"{COEF}\nuniform int[] mjc:path:indices = [0, 0]"),),
    ),
    "a moment arm of zero": (
        "moment_arm_sign",
        FLEXOR,
        "warning",
        ((COEF, COEF.replace("0.0055", "0")),),
    ),
    "arms that only open": (
        "moment_arm_sign",
        FLEXOR,
        "warning",
        ((COEF, COEF.replace("0.008", "-0.008").replace("0.0055", "-0.0055")),),
    ),
    "a servo of nothing": (
        "tendon_drive",
        FLEXOR,
        "error",
        (("tendon:forceLimit = 21", "tendon:forceLimit = 0"),),
    ),
    "a servo too weak": (
        "closing_force",
        FLEXOR,
        "error",
        (("tendon:forceLimit = 21", "tendon:forceLimit = 0.5"),),
    ),
    "a spool for a watch": (
        "spool",
        FLEXOR,
        "warning",
        ((SPOOL, "double tendon:spoolRadius = 0.001"),),
    ),
    "springs too soft to open": (
        "slack",
        FLEXOR,
        "note",
        (
            (SPRING, SPRING.replace("0.045", "0.003")),
            ("mjc:stiffness = 0.03", "mjc:stiffness = 0.002"),
        ),
    ),
    "springs that close": (
        "slack",
        FLEXOR,
        "warning",
        (("mjc:springref = 0", "mjc:springref = 75"),),
    ),
}


def spoiled(folder: Path, case: str) -> Path:
    """Write the finger with the changes of a case."""
    return write_changed(folder, "finger", *CASES[case][3])


@pytest.mark.parametrize("case", CASES)
def test_a_fault_is_named_with_its_prim_and_its_remedy(case: str, tmp_path: Path) -> None:
    """Rule, severity and prim are those of the fault; loading never gives a traceback."""
    rule, prim, severity, _ = CASES[case]
    path = spoiled(tmp_path, case)
    began = process_time()
    findings = check_asset(path)
    assert process_time() - began < LIMIT
    assert (rule, prim, severity) in {(f.rule, f.prim, f.severity) for f in findings}
    assert all(f.message and f.remedy and not f.message.endswith(".") for f in findings)
    if severity == "error" and rule != "closing_force":
        with pytest.raises(InvalidAsset):
            load_mechanism(path)


def test_several_faults_are_named_at_once(tmp_path: Path) -> None:
    """One run of the check lists them all: mending is one round, not seven."""
    several = (
        "a mass of micrograms",
        "a range in radians",
        "a servo of nothing",
        "no end stop",
        "a damping that drives",
        "too many moment arms",
        "gravity in cm/s^2",
    )
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
