"""Small USD assets with three joints, written for a test."""

from collections.abc import Sequence
from pathlib import Path

LINK = 0.03  # m
TREES = {
    # parents of the three links (-1: base), axes of the three joints
    "planar": ((-1, 0, 1), ("Y", "Y", "Y")),
    "spatial": ((-1, 0, 1), ("Z", "Y", "X")),
    "branching": ((-1, 0, 0), ("Y", "Y", "Z")),
}
_LINK = """
    def Xform "link_{i}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {{
        double3 xformOp:translate = ({x}, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        float physics:mass = {mass}
        point3f physics:centerOfMass = (0.015, 0.002, -0.003)
        float3 physics:diagonalInertia = (2.0e-6, 3.0e-6, 4.0e-6)
        quatf physics:principalAxes = (1, 0, 0, 0)
    }}
"""
_JOINT = """
        def PhysicsRevoluteJoint "joint_{i}" (prepend apiSchemas = ["NewtonJointAPI"])
        {{
            uniform token physics:axis = "{axis}"
            rel physics:body0 = </chain/{parent}>
            rel physics:body1 = </chain/link_{i}>
            point3f physics:localPos0 = ({x}, 0, 0)
            point3f physics:localPos1 = (0, 0, 0)
            quatf physics:localRot0 = (1, 0, 0, 0)
            quatf physics:localRot1 = (1, 0, 0, 0)
            float physics:lowerLimit = -90
            float physics:upperLimit = 90
            float newton:limitStiffness = 0.5
            float newton:limitDamping = 1e-4
            float newton:damping = 1.0e-5
            float newton:friction = 0
            uniform double mjc:stiffness = 0.05
            uniform double mjc:springref = 0
        }}
"""
_TENDON = """
        def MjcTendon "flexor_{d}"
        {{
            uniform token mjc:type = "fixed"
            rel mjc:path = [{path}]
            uniform double[] mjc:path:coef = [{arms}]
            double tendon:spoolRadius = 0.0125
            double tendon:forceLimit = 21
            double tendon:excursionOffset = 0
            bool tendon:direct = false
        }}
"""
_CHAIN = """#usda 1.0
(
    defaultPrim = "chain"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
)

def Xform "chain" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{{
    def PhysicsScene "scene"
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = 9.81
    }}
    def Xform "base"
    {{
    }}
{links}
    def Scope "joints"
    {{
{joints}
    }}
    def Scope "tendons"
    {{
{tendons}
    }}
}}
"""


def write_chain(folder: Path, tree: str) -> Path:
    """Write one of the trees and return its file."""
    parents, axes = TREES[tree]
    masses = [0.012 - 0.002 * i for i in range(3)]
    path = folder / f"{tree}.usda"
    path.write_text(chain_text(parents, axes, masses, [(0.006, 0.005, 0.004)]))
    return path


def chain_text(
    parents: Sequence[int],
    axes: Sequence[str],
    masses: Sequence[float],
    arms: Sequence[Sequence[float]],
) -> str:
    """Return the USD text of a tree of links.

    Args:
        parents: Parent of each link, -1 for the base.
        masses: Of the links [kg].
        arms: Moment arms of each tendon at each joint [m].
    """
    links, bones, place = [], [], {-1: 0.0}
    for i, (parent, axis, mass) in enumerate(zip(parents, axes, masses, strict=True)):
        offset = 0.0 if parent < 0 else LINK
        place[i] = place[parent] + offset
        links.append(_LINK.format(i=i, x=place[i], mass=mass))
        name = "base" if parent < 0 else f"link_{parent}"
        bones.append(_JOINT.format(i=i, axis=axis, parent=name, x=offset))
    path = ", ".join(f"</chain/joints/joint_{i}>" for i in range(len(axes)))
    strings = [
        _TENDON.format(d=d, path=path, arms=", ".join(map(str, own))) for d, own in enumerate(arms)
    ]
    return _CHAIN.format(links="".join(links), joints="".join(bones), tendons="".join(strings))
