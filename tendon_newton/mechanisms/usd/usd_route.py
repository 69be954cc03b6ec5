"""How the path of a routed tendon comes in from USD: through sites, around cylinders.

The prim is MuJoCo's own: ``mjc:type = "spatial"``, ``mjc:path`` to sites and cylinders in order,
and for each cylinder a side site through ``mjc:sideSites`` and ``mjc:sideSites:indices``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import newton
import numpy as np
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import frames_of
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.routing import (
    Pulley,
    Route,
    RoutedSpan,
    RouteSite,
    seen_ends,
    side_turn,
)

# Half of the range of a joint without a stop [rad] that is taken for its middle
OPEN_END = np.pi / 2.0


@dataclass(frozen=True, kw_only=True)
class PathTarget:
    """One thing on the path of a routed tendon."""

    prim: str  # Path of a site or a cylinder
    side: str | None = None  # Path of a cylinder's side site


def authored(prim: Any, name: str, default: Any) -> Any:
    """Return the value of a prim's attribute, or a default where it has none."""
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute else None
    return default if value is None else value


def stated(prim: Any, usual: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of some of a prim's attributes, and what is usual where it has none."""
    return {name: authored(prim, name, default) for name, default in usual.items()}


def is_routed(prim: Any) -> bool:
    """Tell whether a tendon's moment arms follow from its path; so they do by MuJoCo's default."""
    return prim.GetTypeName() == "MjcTendon" and authored(prim, "mjc:type", "spatial") == "spatial"


def targets_of(prim: Any, name: str) -> list[str]:
    """Return the paths that a relationship of a prim points to."""
    relationship = prim.GetRelationship(name)
    return [str(path) for path in relationship.GetTargets()] if relationship else []


def path_targets(prim: Any) -> list[PathTarget]:
    """Return what a routed tendon passes, in its order, less an index that points nowhere."""
    targets, sides = targets_of(prim, "mjc:path"), targets_of(prim, "mjc:sideSites")
    places = authored(prim, "mjc:path:indices", None) or range(len(targets))
    side_of = authored(prim, "mjc:sideSites:indices", ())
    found = []
    for position, place in enumerate(places):
        side = side_of[position] if position < len(side_of) else -1
        if 0 <= place < len(targets):
            beside = sides[side] if 0 <= side < len(sides) else None
            found.append(PathTarget(prim=targets[place], side=beside))
    return found


def path_rows(prim: Any, context: dict[str, Any], tendon: int) -> list[dict[str, Any]]:
    """Return one row per site or cylinder on a tendon's path, as `usd_tendon` registers them."""
    builder, shapes = context["builder"], context["result"]["path_shape_map"]
    rows = []
    for target in path_targets(prim):
        shape = shapes[target.prim]
        place = builder.shape_transform[shape]
        side = wp.vec3()
        if target.side is not None:
            side = wp.transform_get_translation(builder.shape_transform[shapes[target.side]])
        is_site = bool(builder.shape_flags[shape] & newton.ShapeFlags.SITE)
        rows.append(
            {
                "tendon:path_tendon": tendon,
                "tendon:path_shape": shape,
                "tendon:path_body": builder.shape_body[shape],
                "tendon:path_point": wp.transform_get_translation(place),
                "tendon:path_rotation": wp.transform_get_rotation(place),
                "tendon:path_radius": 0.0 if is_site else float(builder.shape_scale[shape][0]),
                "tendon:path_side": side,
            }
        )
    return rows


def read_route(
    rows: dict[str, list[Any]], tendon: int, prim: Any, joints: tuple[Joint, ...]
) -> Route:
    """Return the route of one tendon from the rows that Newton keeps.

    `rows` has columns of ``model.tendon.path_*`` by the name after ``path_``; the prim knows the
    names.
    """
    limits = np.array([joint.limits for joint in joints])
    middle = np.where(np.isfinite(limits), limits, [-OPEN_END, OPEN_END]).mean(axis=1)
    own = [row for row, owner in enumerate(rows["tendon"]) if owner == tendon]
    names = [target.prim for target in path_targets(prim)]
    spans: list[RoutedSpan] = []
    start: RouteSite | None = None
    pulley: Pulley | None = None
    for row, name in zip(own, names, strict=True):
        body, point = int(rows["body"][row]), np.array(rows["point"][row], dtype=np.float64)
        if rows["radius"][row] > 0.0:
            matrix = np.array(wp.quat_to_matrix(rows["rotation"][row]), dtype=np.float64)
            pulley = Pulley(
                prim=name,
                body=body,
                point=point,
                rotation=matrix.reshape(3, 3),
                radius=float(rows["radius"][row]),
                side=np.array(rows["side"][row], dtype=np.float64),
            )
            continue
        end = RouteSite(prim=name, body=body, point=point)
        if start is not None:
            span = RoutedSpan(start=start, end=end, pulley=pulley)
            spans.append(turned_span(span, joints, middle))
        start, pulley = end, None
    return Route(joints=joints, spans=tuple(spans))


def turned_span(span: RoutedSpan, joints: tuple[Joint, ...], joint_position: Array) -> RoutedSpan:
    """Return a span whose string goes round its pulley on the side of the side site.

    The side is decided at joint positions (J,) [rad].
    """
    pulley = span.pulley
    if pulley is None:
        return span
    frames = frames_of(joints, joint_position)
    side = (pulley.side - pulley.point) @ pulley.rotation
    turn = side_turn(*seen_ends(span, frames), side, pulley.radius)
    return replace(span, pulley=replace(pulley, turn=turn))
