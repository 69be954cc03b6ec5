"""A foreign file as a plan of an asset: USD's own frames and units, and its drives on top."""

from dataclasses import dataclass
from math import degrees, isfinite, radians, sqrt
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset, unknown_name
from tendon_newton.mechanisms.authoring.asset_folder import write_layers
from tendon_newton.mechanisms.authoring.asset_plan import (
    SLENDERNESS,
    STOP_DAMPING_RATIO,
    STOP_STIFFNESS,
    check_name,
    check_range,
    spread,
)
from tendon_newton.mechanisms.authoring.foreign_file import TAKEN, ForeignFinger, unique, word
from tendon_newton.mechanisms.geometry.joint_frames import Posture, ancestors, frames_of
from tendon_newton.mechanisms.geometry.joints import Joint, ReadOnlyArrays

LAYERS = ("interface", "links", "tendon")
RESERVED = (*LAYERS, *TAKEN, "tip")  # Names that a file or a prim of an imported asset has already
# Stiffness of stops that a file leaves to Newton [N m/rad]: too hard for links of some grams
IMPORTED_STOP = 1.0e4
LEAST_BONE = 1.0e-4  # Length below which no bone is drawn [m]


@dataclass(frozen=True, kw_only=True)
class ForeignBone:
    """A capsule from a joint to the next one or the tip, for the eye only."""

    length: float
    radius: float
    place: Array  # Middle of the bone in the link's frame [m], shape (3,)
    turn: Array  # Quaternion (w, x, y, z) from its axis x to the link's frame


@dataclass(frozen=True, kw_only=True)
class ForeignJoint(ReadOnlyArrays):
    """A joint and its link as USD writes them: quaternions are (w, x, y, z), angles in degrees."""

    name: str
    link: str
    carrier: str  # Link, or the base, that it sits on
    schema: str
    units: str
    place: Array
    turn: Array
    carrier_place: Array
    carrier_turn: Array
    own_place: Array
    own_turn: Array
    mass: float
    center_of_mass: Array
    inertia: Array
    principal_axes: Array
    lower: float | None
    upper: float | None
    stop_stiffness: float
    stop_damping: float
    damping: float
    friction: float
    stiffness: float
    rest: float
    bone: ForeignBone | None


@dataclass(frozen=True, kw_only=True)
class ForeignPlan(ReadOnlyArrays):
    """Everything that the layers of an imported asset say."""

    name: str
    source: str  # Name of the file that it came from
    joints: tuple[ForeignJoint, ...]
    # Moment arms of the one tendon; none where each joint has a servo of its own
    moment_arms: tuple[float, ...]
    springs: tuple[float, ...]  # Return springs that are added; none where the file has its own
    spool_radius: float
    force_limit: float
    gravity: float
    gravity_direction: Array
    tip_link: str | None
    tip_point: Array | None


def plan_foreign(
    name: str,
    finger: ForeignFinger,
    *,
    moment_arm: tuple[float, ...] = (),
    stiffness: tuple[float, ...] = (),
    tip: tuple[float, float, float] | None = None,
    tip_link: str | None = None,
    spool_radius: float = 0.0125,
    force_limit: float = 21.0,
) -> ForeignPlan:
    """Plan an asset from a foreign file: a finger with a tendon, or an arm.

    Args:
        name: Name of the asset.
        finger: Content of the foreign file.
        moment_arm: Moment arm of the tendon at each joint [m/rad], positive closes; one value may
            serve all. Without any each joint has a servo of its own.
        stiffness: Return springs to add [N m/rad]; none keeps those of the file.
        tip: The tip in a link's frame [m]; none takes the file's site of that name.
        tip_link: That link; the last by default.
        spool_radius: Spool radius [m].
        force_limit: The most that a servo can give: pull [N], or torque [N m] of an arm's.

    Raises:
        InvalidAsset: A number is missing or is no finger's.
    """
    count = len(finger.joints)
    check_name(name, RESERVED)
    check_range("spool_radius", spool_radius)
    check_range("force_limit", force_limit)
    arms = spread("moment_arm", moment_arm, count) if moment_arm else ()
    springs = spread("stiffness", stiffness, count) if stiffness else ()
    at = finger.tip if tip is None else (find_link(finger, tip_link), np.array(tip))
    if at is None and arms:
        raise InvalidAsset(
            f"{finger.source}: a finger has a tip: name a site of the file 'tip', or give its "
            "place in the last link with --tip"
        )
    gravity = float(np.linalg.norm(finger.gravity))
    names = unique([word(joint.name) for joint in finger.joints], ())
    return ForeignPlan(
        name=name,
        source=finger.source.name,
        joints=tuple(
            foreign_joint(finger, names, index, at, springs[index] if springs else None)
            for index in range(count)
        ),
        moment_arms=arms,
        springs=springs,
        spool_radius=spool_radius,
        force_limit=force_limit,
        gravity=gravity,
        gravity_direction=finger.gravity / gravity if gravity else np.array([0.0, 0.0, -1.0]),
        tip_link=finger.links[at[0]] if at else None,
        tip_point=at[1] if at else None,
    )


def find_link(finger: ForeignFinger, name: str | None) -> int:
    """Return the index of a link; the last where no name is given.

    Raises:
        UnknownName: No link has that name.
    """
    if name is None:
        return len(finger.links) - 1
    if name not in finger.links:
        raise unknown_name(f"link of {finger.source.name}", name, finger.links)
    return finger.links.index(name)


def foreign_joint(
    finger: ForeignFinger,
    names: tuple[str, ...],
    index: int,
    tip: tuple[int, Array] | None,
    spring: float | None,
) -> ForeignJoint:
    """Turn a joint that Newton read into what USD writes; its axis becomes x of its frames."""
    joint = finger.joints[index]
    along = frame_along(joint.axis)
    posture = frames_of(finger.joints, np.zeros(len(names)))
    moments, axes = np.linalg.eigh(joint.inertia)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    turns = joint.kind == "revolute"
    per = radians(1.0) if turns else 1.0
    bounded = isfinite(joint.limits[0]) and isfinite(joint.limits[1])
    ends = [degrees(end) if turns else end for end in joint.limits] if bounded else [None, None]
    soft = joint.stop_stiffness < IMPORTED_STOP
    stop = joint.stop_stiffness if soft else STOP_STIFFNESS
    damping = joint.stop_damping if soft else stop_damping(finger.joints, posture, index)
    return ForeignJoint(
        name=names[index],
        link=finger.links[index],
        carrier="base" if joint.parent < 0 else finger.links[joint.parent],
        schema="PhysicsRevoluteJoint" if turns else "PhysicsPrismaticJoint",
        units="degrees: deg, N m/deg, N m s/deg; friction in N m" if turns else "m, N/m, N s/m, N",
        place=posture.position[index],
        turn=quaternion(posture.rotation[index]),
        carrier_place=joint.parent_position,
        carrier_turn=quaternion(joint.parent_rotation @ along),
        own_place=joint.child_position,
        own_turn=quaternion(joint.child_rotation @ along),
        mass=joint.mass,
        center_of_mass=joint.center_of_mass,
        inertia=moments,
        principal_axes=quaternion(axes),
        lower=ends[0],
        upper=ends[1],
        stop_stiffness=per * stop,
        stop_damping=per * damping,
        damping=per * joint.damping,
        friction=joint.friction,
        stiffness=joint.stiffness if spring is None else spring,
        rest=degrees(joint.rest) if turns else joint.rest,
        bone=bone(finger.joints, index, tip),
    )


def frame_along(axis: Array) -> Array:
    """Return a rotation matrix whose first column is along an axis, shape (3, 3)."""
    first = axis / np.linalg.norm(axis)
    aside = np.eye(3)[int(np.argmin(np.abs(first)))]
    second: Array = np.asarray(np.cross(first, aside), dtype=np.float64)
    second = second / np.linalg.norm(second)
    return np.column_stack([first, second, np.cross(first, second)])


def stop_damping(joints: tuple[Joint, ...], posture: Posture, index: int) -> float:
    """Return a damping for the stops of a joint [N m s/rad], from all that swings beyond it."""
    axis, inertia = posture.axis[index], 0.0
    for other, link in enumerate(joints):
        if index not in ancestors([joint.parent for joint in joints], other):
            continue
        rotation = posture.rotation[other]
        arm = posture.position[other] + rotation @ link.center_of_mass - posture.anchor[index]
        own = rotation @ link.inertia @ rotation.T
        if joints[index].kind == "revolute":
            inertia += float(axis @ own @ axis) + link.mass * float(
                np.sum(np.cross(axis, arm) ** 2)
            )
        else:
            inertia += link.mass
    return 2.0 * STOP_DAMPING_RATIO * sqrt(STOP_STIFFNESS * inertia)


def bone(
    joints: tuple[Joint, ...], index: int, tip: tuple[int, Array] | None
) -> ForeignBone | None:
    """Return a capsule from a joint to what comes next on its link."""
    start = joints[index].child_position
    ends = [joint.parent_position for joint in joints if joint.parent == index]
    if tip is not None and tip[0] == index:
        ends.append(tip[1])
    if not ends:
        return None
    reach = ends[0] - start
    length = float(np.linalg.norm(reach))
    if length < LEAST_BONE:
        return None
    return ForeignBone(
        length=length,
        radius=SLENDERNESS * length,
        place=start + 0.5 * reach,
        turn=quaternion(frame_along(reach)),
    )


def quaternion(turn: Array) -> Array:
    """Return a rotation matrix as USD writes it: (w, x, y, z)."""
    x, y, z, w = Rotation.from_matrix(turn).as_quat(canonical=True)
    return np.array([w, x, y, z])


ROUNDING = 1.0e-7  # Share of a vector's largest component that is rounding of float32 [1]


def write_foreign(folder: Path, plan: ForeignPlan) -> Path:
    """Write the layers of an imported asset into a new folder, and return the file to open.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    filters = {"number": number, "vector": vector}
    return write_layers(folder, "imported_asset", LAYERS, plan, filters)


def number(value: float) -> str:
    """Write a number with the digits of Newton's float32, and no more."""
    return f"{value:.7g}"


def vector(values: Array) -> str:
    """Write a vector; what is but rounding beside its largest component is zero."""
    least = ROUNDING * float(np.max(np.abs(values)))
    return f"({', '.join(number(v) if abs(v) > least else '0' for v in values)})"
