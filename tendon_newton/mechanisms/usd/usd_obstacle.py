"""How obstacles come in from USD: a shape of the base, or a link's capsule, marked by an attribute.

``bool tendon:obstacle = true`` on the shape's prim makes it one; ``tendon:contactStiffness`` [N/m],
``tendon:contactDissipation`` [s/m] and ``tendon:contactFriction`` [1] say what the contact is like.
``physics:mass`` [kg], of UsdPhysics' MassAPI, lets it move; its inertia is that of a solid.

A link's capsule is met by links of other fingers: by all, or by those alone that ``rel
tendon:metBy`` leads to.
"""

from pathlib import Path
from typing import Any

import newton
import numpy as np
import warp as wp

from tendon_newton.errors import InvalidAsset, InvalidParameter
from tendon_newton.mechanisms.geometry.obstacles import (
    DISSIPATION,
    FRICTION,
    STIFFNESS,
    Box,
    LinkObstacle,
    Obstacle,
    Plane,
    Sphere,
)
from tendon_newton.mechanisms.usd.usd_route import stated

MARK = "tendon:obstacle"
MET_BY = "tendon:metBy"
MASS = "physics:mass"
UNKNOWN_MASS = 0.0  # By which UsdPhysics says that a mass is not given [kg]
# What is read of a shape's prim, and what counts where it has none
SHAPE = {
    MARK: False,
    MASS: UNKNOWN_MASS,
    "tendon:contactStiffness": STIFFNESS,
    "tendon:contactDissipation": DISSIPATION,
    "tendon:contactFriction": FRICTION,
}


def read_obstacles(stage: Any, builder: newton.ModelBuilder, path: Path) -> tuple[Obstacle, ...]:
    """Read the obstacles of a stage, in the order of their prims.

    Raises:
        InvalidAsset: A marked prim is neither a shape of the base nor a link's capsule, or its
            numbers have no meaning.
    """
    shapes = {label: shape for shape, label in enumerate(builder.shape_label)}
    told = [(prim, stated(prim, SHAPE)) for prim in stage.Traverse()]
    found = []
    for prim, values in told:
        if not values[MARK]:
            continue
        name = str(prim.GetPath())
        shape = shapes.get(name, -1)
        carried = shape >= 0 and builder.shape_body[shape] >= 0
        if shape < 0 or (carried and builder.shape_type[shape] != newton.GeoType.CAPSULE):
            raise InvalidAsset(
                f"{path}: {name}: {MARK} belongs to a shape of the base, which nothing moves, or "
                "to a link's capsule"
            )
        try:
            found.append(_obstacle(prim, values, builder, shape))
        except InvalidParameter as error:
            raise InvalidAsset(f"{path}: {name}: {error}") from None
    return tuple(found)


def _obstacle(
    prim: Any, values: dict[str, Any], builder: newton.ModelBuilder, shape: int
) -> Obstacle:
    """Return the obstacle of one shape."""
    place: Any = builder.shape_transform[shape]
    position = np.array(wp.transform_get_translation(place), dtype=np.float64)
    matrix = np.array(wp.quat_to_matrix(wp.transform_get_rotation(place)), dtype=np.float64)
    turn, size = matrix.reshape(3, 3), np.array(builder.shape_scale[shape], dtype=np.float64)
    names = ("stiffness", "dissipation", "friction")
    numbers = {name: float(values[f"tendon:contact{name.capitalize()}"]) for name in names}
    if builder.shape_body[shape] >= 0:
        targets = prim.GetRelationship(MET_BY).GetTargets()
        return LinkObstacle(link=str(prim.GetPath()), met_by=list(map(str, targets)), **numbers)
    mass = float(values[MASS])
    if mass != UNKNOWN_MASS:
        numbers["mass"] = mass
        # what moves has a shape of its own; this one would stay where it was
        builder.shape_flags[shape] &= ~newton.ShapeFlags.VISIBLE
    kind = builder.shape_type[shape]
    if kind == newton.GeoType.SPHERE:
        return Sphere(position=position, radius=float(size[0]), **numbers)
    if kind == newton.GeoType.BOX:
        return Box(position=position, half_size=size, turn=turn, **numbers)
    if kind == newton.GeoType.PLANE:
        return Plane(position=position, normal=turn[:, 2], **numbers)
    raise InvalidParameter(
        f"an obstacle is a sphere, a cube or a plane; this is a {newton.GeoType(kind).name.lower()}"
    )
