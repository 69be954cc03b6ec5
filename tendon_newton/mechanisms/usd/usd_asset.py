"""From a USD file to a Newton builder of one world, and from that to the parts of a mechanism."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import warnings
from pathlib import Path
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.usd import SchemaResolverMjc, SchemaResolverNewton

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.geometry.joints import Joint, JointKind
from tendon_newton.mechanisms.geometry.parts import Tendon, Tip
from tendon_newton.mechanisms.usd.stage_file import REASON_LENGTH
from tendon_newton.mechanisms.usd.usd_route import authored, is_routed, read_route
from tendon_newton.mechanisms.usd.usd_tendon import (
    is_tendon_prim,
    register_tendon_attributes,
    tendon_arms,
    tendon_numbers,
)

_KINDS: dict[int, JointKind] = {
    int(newton.JointType.REVOLUTE): "revolute",
    int(newton.JointType.PRISMATIC): "prismatic",
}
_UNLIMITED = 1.0e6  # Newton writes a joint without limits as +-1e10 [rad]; no bench turns this far


def asset_name(stage: Any, path: Path) -> str:
    """Return the name that messages use: of the default prim, else of the file."""
    prim = stage.GetDefaultPrim()
    return str(prim.GetName()) if prim else path.stem


def read_template(stage: Any, path: Path) -> newton.ModelBuilder:
    """Let Newton read a stage as one world.

    Fixed joints are merged into what they join, so that every joint left has a degree of freedom.
    """
    builder = newton.ModelBuilder()
    register_tendon_attributes(builder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            builder.add_usd(
                stage,
                schema_resolvers=[SchemaResolverNewton(), SchemaResolverMjc()],
                collapse_fixed_joints=True,
            )
            adopt_orphans(builder, asset_name(stage, path))
        except Exception as error:  # Newton raises whatever its code meets in a strange file
            reason = " ".join(str(error).split())[:REASON_LENGTH]
            raise InvalidAsset(f"Newton cannot read {path}: {reason}") from error
    return builder


def adopt_orphans(builder: newton.ModelBuilder, name: str) -> None:
    """Put joints that are in no articulation into one.

    USD gives none to a chain of one link, and without it ``newton.eval_fk`` would pass it over.
    """
    orphans = [j for j, owner in enumerate(builder.joint_articulation) if owner < 0]
    if orphans:
        builder.add_articulation(orphans, label=f"/{name}")


def read_joints(builder: newton.ModelBuilder, path: Path) -> tuple[Joint, ...]:
    """Read the joints and their links from a builder, in the order of the degrees of freedom."""
    for index, kind in enumerate(builder.joint_type):
        if int(kind) not in _KINDS or builder.joint_child[index] != index:
            raise InvalidAsset(
                f"{path}: a mechanism is a tree of revolute and prismatic joints on a fixed base; "
                f"{builder.joint_label[index]} is a {newton.JointType(kind).name.lower()} joint."
            )
    return tuple(_read_joint(builder, index) for index in range(builder.joint_count))


def _read_joint(builder: newton.ModelBuilder, index: int) -> Joint:
    parent_position, parent_rotation = _frame(builder.joint_X_p[index])
    child_position, child_rotation = _frame(builder.joint_X_c[index])
    prim = builder.joint_label[index]
    return Joint(
        name=prim.rsplit("/", maxsplit=1)[-1],
        prim=prim,
        kind=_KINDS[int(builder.joint_type[index])],
        parent=int(builder.joint_parent[index]),
        axis=np.array(builder.joint_axis[index]),
        parent_position=parent_position,
        parent_rotation=parent_rotation,
        child_position=child_position,
        child_rotation=child_rotation,
        limits=_limits(builder, index),
        stop_stiffness=float(builder.joint_limit_ke[index]),
        stop_damping=float(builder.joint_limit_kd[index]),
        stiffness=float(builder.joint_stiffness[index]),
        rest=float(builder.joint_rest_q[index]),
        damping=float(builder.joint_damping[index]),
        friction=float(builder.joint_friction[index]),
        mass=float(builder.body_mass[index]),
        center_of_mass=np.array(builder.body_com[index]),
        inertia=np.array(builder.body_inertia[index]).reshape(3, 3),
        length=_length(builder, index),
    )


def _frame(transform: Any) -> tuple[Array, Array]:
    """Return position (3,) and rotation matrix (3, 3) of a Warp transform."""
    rotation = np.array(wp.quat_to_matrix(wp.transform_get_rotation(transform))).reshape(3, 3)
    return np.array(wp.transform_get_translation(transform)), rotation


def _limits(builder: newton.ModelBuilder, index: int) -> tuple[float, float]:
    lower = float(builder.joint_limit_lower[index])
    upper = float(builder.joint_limit_upper[index])
    return (-np.inf if lower < -_UNLIMITED else lower, np.inf if upper > _UNLIMITED else upper)


def _length(builder: newton.ModelBuilder, index: int) -> float | None:
    """Return the distance from a joint to the next joint, else to the tip."""
    if int(builder.joint_type[index]) != newton.JointType.REVOLUTE:
        return None
    anchor = _frame(builder.joint_X_c[index])[0]
    ends = [
        _frame(builder.joint_X_p[child])[0]
        for child in range(builder.joint_count)
        if builder.joint_parent[child] == index
    ]
    tip = read_tip(builder)
    if tip is not None and tip.body == index:
        ends.append(tip.point)
    length = float(np.linalg.norm(ends[0] - anchor)) if ends else 0.0
    return length if length > 0.0 else None


def read_tendons(
    stage: Any, builder: newton.ModelBuilder, joints: tuple[Joint, ...]
) -> tuple[Tendon, ...]:
    """Read the tendons of a stage, in the order of Newton's rows."""
    prims = [prim for prim in stage.Traverse() if is_tendon_prim(prim, {})]
    tendons = tuple(_read_tendon(p, d, builder, joints) for d, p in enumerate(prims))
    _keep_turns(builder, tendons)
    return tendons


def _read_tendon(
    prim: Any, number: int, builder: newton.ModelBuilder, joints: tuple[Joint, ...]
) -> Tendon:
    index = {joint.prim: j for j, joint in enumerate(joints)}
    arms = np.zeros(len(joints))
    for path, coefficient in tendon_arms(prim):
        arms[index[path]] += coefficient
    route = None
    if is_routed(prim):
        names = ("tendon", "body", "point", "rotation", "radius", "side")
        rows = {name: _rows(builder, f"tendon:path_{name}") for name in names}
        route = read_route(rows, number, prim, joints)
        arms = route.moment_arms(arms)
    return Tendon(
        name=prim.GetName(),
        prim=str(prim.GetPath()),
        moment_arm=arms,
        **tendon_numbers(prim),
        servo=str(authored(prim, "tendon:servo", "")),
        direct=bool(authored(prim, "tendon:direct", False)),
        route=route,
    )


def _keep_turns(builder: newton.ModelBuilder, tendons: tuple[Tendon, ...]) -> None:
    """Write into Newton's rows which way round its pulleys each string goes."""
    pulleys = (
        span.pulley
        for tendon in tendons
        if tendon.route is not None
        for span in tendon.route.spans
        if span.pulley is not None
    )
    attribute = builder.custom_attributes["tendon:path_turn"]
    radii = _rows(builder, "tendon:path_radius")
    attribute.values = [next(pulleys).turn if radius > 0.0 else 1.0 for radius in radii]


def read_tip(builder: newton.ModelBuilder) -> Tip | None:
    """Read the tip, where the asset has one."""
    bodies = _rows(builder, "tendon:tip_body")
    if not bodies:
        return None
    point = _rows(builder, "tendon:tip_point")[0]
    return Tip(body=int(bodies[0]), point=np.array(point))


def _rows(builder: newton.ModelBuilder, key: str) -> list[Any]:
    return list(builder.custom_attributes[key].values or [])


def read_gravity(builder: newton.ModelBuilder) -> Array:
    """Read the acceleration of gravity [m/s^2], shape (3,)."""
    gravity = np.array(builder.gravity, dtype=np.float64)
    # A stage with a physics scene gives a vector, one without leaves Newton's number along z.
    return gravity if gravity.ndim else gravity * np.array(builder.up_vector, dtype=np.float64)
