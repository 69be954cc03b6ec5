"""Two fingers that face each other, for the tests of links that meet."""

from pathlib import Path

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import STIFFNESS, LinkObstacle
from tendon_newton.mechanisms.loading import load_mechanism
from tests.physics.contact.bodies import BONES

PINCH = """#usda 1.0
(
    defaultPrim = "pinch"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
)

def Xform "pinch" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{{
    def Xform "left" (
        prepend references = @{finger}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        {left}
    }}
    def Xform "right" (
        prepend references = @{finger}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        double3 xformOp:translate = {place}
        double3 xformOp:rotateXYZ = {turn}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]

        over "scene" (
            active = false
        )
        {{
        }}
        over "distal_phalanx"
        {{
            over "tip" (
                active = false
            )
            {{
            }}
        }}
        {right}
    }}
}}
"""
"""Two of the nominal fingers."""
FACING = ((0.045, 0.001, -0.040), (0.0, 180.0, 0.0))
"""Place [m] and turn [deg] of a second finger that closes upwards against the first, in its plane
but for a millimetre."""
CROSSED = ((0.040, -0.022, -0.020), (0.0, 0.0, 90.0))
"""The same of one that lies across and below the first."""
Place = tuple[tuple[float, float, float], tuple[float, float, float]]


def write_pinch(folder: Path, place: Place = FACING, *, left: str = "", right: str = "") -> Path:
    """Write two fingers, with more in the prims of each, and return their file."""
    path = folder / "pinch.usda"
    where, turn = place
    finger = asset_path("finger").resolve()
    path.write_text(PINCH.format(finger=finger, place=where, turn=turn, left=left, right=right))
    return path


def pinch(
    folder: Path, place: Place = FACING, *, friction: float = 0.0, stiffness: float = STIFFNESS
) -> Mechanism:
    """Return two fingers, of which the second meets both links of the first."""
    links = (
        LinkObstacle(link=f"left/{link}_phalanx", friction=friction, stiffness=stiffness)
        for link in ("middle", "distal")
    )
    return load_mechanism(write_pinch(folder, place)).with_obstacles(*links)


def axes_of(mechanism: Mechanism, q: Array) -> list[tuple[Array, Array, float]]:
    """Return where the capsules of both fingers begin and end, and their radii [m], by hand."""
    frames, found = posture(mechanism, q), []
    for link, rotation in enumerate(frames.rotation):
        begin, end, radius = BONES["finger"][link % 2]
        at, along = frames.position[link], rotation[:, 0]
        found.append((at + begin * along, at + end * along, radius))
    return found


def nearest(first: Array, second: Array) -> tuple[Array, Array]:
    """Return where two segments, each of shape (2, 3), come closest [m].

    Between their lines, or from an end of one to the other.
    """
    u, w, r = first[1] - first[0], second[1] - second[0], first[0] - second[0]
    shares = [(s, np.clip((r + s * u) @ w / (w @ w), 0.0, 1.0)) for s in (0.0, 1.0)]
    shares += [(np.clip((t * w - r) @ u / (u @ u), 0.0, 1.0), t) for t in (0.0, 1.0)]
    both = np.linalg.lstsq(np.column_stack([u, -w]), -r, rcond=None)[0]
    if np.all((both >= 0.0) & (both <= 1.0)):
        shares.append((both[0], both[1]))
    points = [(first[0] + s * u, second[0] + t * w) for s, t in shares]
    return min(points, key=lambda pair: float(np.linalg.norm(pair[0] - pair[1])))


def press(mechanism: Mechanism, q: Array, capsule: int, met: int) -> tuple[Array, Array]:
    """Return the force of a smooth contact at rest on a capsule [N], and its torques [N m], (J,).

    The one that it meets gets the opposite force, at the same point.
    """
    axes, frames = axes_of(mechanism, q), posture(mechanism, q)
    (a, b, radius), (c, d, other) = axes[capsule], axes[met]
    here, there = nearest(np.array([a, b]), np.array([c, d]))
    away = (here - there) / np.linalg.norm(here - there)
    depth = radius + other - float(np.linalg.norm(here - there))
    force = mechanism.obstacles[0].stiffness * max(depth, 0.0) * away
    point = 0.5 * (here - radius * away + there + other * away)
    torque = np.zeros(len(q))
    for link, sign in ((capsule, 1.0), (met, -1.0)):
        for joint in ancestors(mechanism.parents, link):
            move = np.cross(frames.axis[joint], point - frames.anchor[joint])
            torque[joint] += sign * float(move @ force)
    return force, torque


def motion_energy(mechanism: Mechanism, q: Array, v: Array) -> float:
    """Return the kinetic energy of links that turn about y [J], by hand."""
    nudge = 1.0e-6  # s
    places = [posture(mechanism, q + way * v) for way in (-nudge, nudge)]
    total = 0.0
    for link, joint in enumerate(mechanism.joints):
        before, after = (p.place(link, joint.center_of_mass) for p in places)
        speed = np.linalg.norm(after - before) / (2.0 * nudge)
        spin = sum(v[j] for j in ancestors(mechanism.parents, link))
        total += 0.5 * joint.mass * speed**2 + 0.5 * joint.inertia[1, 1] * spin**2
    return float(total)


CARRIAGES = """#usda 1.0
(
    defaultPrim = "carriages"
    upAxis = "Z"
    metersPerUnit = 1
    kilogramsPerUnit = 1
)

def Xform "carriages" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{{
    def Xform "back" (
        prepend references = @{slider}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        over "carriage"
        {{
            def Capsule "bar"
            {{
                uniform token axis = "Y"
                double height = 0.02
                double radius = 0.004
            }}
        }}
    }}
    def Xform "front" (
        prepend references = @{slider}@
        delete apiSchemas = ["PhysicsArticulationRootAPI"]
    )
    {{
        double3 xformOp:translate = (0.02, 0.003, 0.004)
        uniform token[] xformOpOrder = ["xformOp:translate"]

        over "scene" (
            active = false
        )
        {{
        }}
        over "carriage"
        {{
            float physics:mass = 0.02

            def Capsule "bar"
            {{
                uniform token axis = "Z"
                double height = 0.03
                double radius = 0.003
            }}
        }}
    }}
}}
"""
"""Two carriages on rails along x, with bars that cross, the front one 20 mm ahead."""


def carriages(folder: Path) -> Mechanism:
    """Return two carriages that run into each other."""
    path = folder / "carriages.usda"
    path.write_text(CARRIAGES.format(slider=asset_path("spring_weak").resolve()))
    return load_mechanism(path).with_obstacles(LinkObstacle(link="back/carriage"))
