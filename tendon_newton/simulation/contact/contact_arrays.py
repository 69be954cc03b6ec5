"""The numbers of contacts as our kernels read them: per world, in the axes of the base."""

from typing import Any

import newton
import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.simulation.chains.rotations import rotation_matrices
from tendon_newton.simulation.contact.contact_plan import (
    FIXED,
    NO_CONTACTS,
    NO_LINK,
    ContactPlan,
    LinkContactPlan,
)

SHAPE_NAMES = {
    int(newton.GeoType.SPHERE): "sphere",
    int(newton.GeoType.BOX): "box",
    int(newton.GeoType.PLANE): "plane",
    int(newton.GeoType.CAPSULE): "capsule",
}


def read_contact_plan(model: Any, moved_by: dict[int, int]) -> ContactPlan:
    """Return which contacts all worlds of a model may have.

    `moved_by` gives the joint of the first world that moves each of its bodies.
    """
    rows = model.tendon
    if not hasattr(rows, "obstacle_shape"):
        return NO_CONTACTS
    first = [
        shapes.numpy().reshape(model.world_count, -1)[0]
        for shapes in (rows.bone_shape, rows.obstacle_shape)
    ]
    bodies, kinds = model.shape_body.numpy()[first[0]], model.shape_type.numpy()[first[1]]
    free = np.flatnonzero(np.isin(first[1], free_shapes(model)))
    plan = ContactPlan(
        links=tuple(moved_by[int(body)] for body in bodies),
        shapes=tuple(SHAPE_NAMES[int(kind)] for kind in kinds),
        body=int(free[0]) if len(free) else FIXED,
    )
    if not hasattr(rows, "meeting_bone"):
        return plan
    bones, obstacles = ([int(shape) for shape in shapes] for shapes in first)
    met = rows.meeting_obstacle.numpy().reshape(model.world_count, -1)[0]
    by = rows.meeting_bone.numpy().reshape(model.world_count, -1)[0]
    return LinkContactPlan(
        links=plan.links,
        shapes=plan.shapes,
        body=plan.body,
        capsules=tuple(bones.index(o) if o in bones else NO_LINK for o in obstacles),
        pairs=tuple(
            (bones.index(bone), obstacles.index(shape)) for bone, shape in zip(by, met, strict=True)
        ),
    )


def free_shapes(model: Any) -> Indices:
    """Return the shapes of a model's free bodies, shape (W,) or (0,)."""
    rows = model.tendon
    if not hasattr(rows, "obstacle_shape"):
        return np.zeros(0, dtype=np.int64)
    shapes = rows.obstacle_shape.numpy()
    carried = model.shape_body.numpy()[shapes] >= 0
    return shapes[carried & ~np.isin(shapes, rows.bone_shape.numpy())]


def contact_numbers(model: Any, plan: ContactPlan, frames: Any, basis: Array | None) -> Any:
    """Return the numbers of a model's contacts by the names that the kernels use.

    The frames are its `RestFrames`; the basis is that of the plane (2, 3) in which the chain moves.
    """
    rows, worlds = model.tendon, model.world_count
    shapes = rows.obstacle_shape.numpy().reshape(worlds, -1)
    place = model.shape_transform.numpy().astype(np.float64)[shapes]
    if plan.moves:
        carriers = model.shape_body.numpy()[shapes[:, plan.body]]
        place[:, plan.body] = model.body_q.numpy()[carriers]
    names = ("stiffness", "dissipation", "friction")
    return {
        "obstacle_position": place[..., :3],
        "obstacle_rotation": rotation_matrices(place[..., 3:]),
        "obstacle_size": model.shape_scale.numpy()[shapes],
        **{
            f"obstacle_{n}": getattr(rows, f"obstacle_{n}").numpy().reshape(worlds, -1)
            for n in names
        },
        **capsule_numbers(model, plan, frames, basis),
    }


def capsule_numbers(model: Any, plan: ContactPlan, frames: Any, basis: Array | None) -> Any:
    """Return where the capsules' axes begin and end from their joints, and their radii."""
    bones = model.tendon.bone_shape.numpy().reshape(model.world_count, -1)
    place = model.shape_transform.numpy().astype(np.float64)[bones]
    size = model.shape_scale.numpy().astype(np.float64)[bones]
    links = np.array(plan.links)
    half = rotation_matrices(place[..., 3:])[..., 2] * size[..., 1:2]
    out: dict[str, Array] = {"capsule_radius": size[..., 0]}
    for name, own in (("start", place[..., :3] - half), ("end", place[..., :3] + half)):
        turned = np.einsum("wcab,wcb->wca", frames.body_rotation[:, links], own)
        point = turned + frames.body_position[:, links] - frames.origin[:, links]
        if basis is not None:
            normal = np.cross(basis[0], basis[1])
            # Joints know their places in the plane alone: how far off it is the capsule's own.
            height = (point + frames.origin[:, links]) @ normal
            point = np.concatenate([point @ basis.T, height[..., None]], axis=-1)
        out[f"capsule_{name}"] = point
    return out


def body_numbers(model: Any, gravity: Array) -> dict[str, Array]:
    """Return mass, inertia and gravity of each world's free body, from gravity (W, 3) [m/s2]."""
    bodies = model.shape_body.numpy()[free_shapes(model)]
    return {
        "body_mass": model.body_mass.numpy()[bodies],
        "body_inertia": model.body_inertia.numpy()[bodies][:, range(3), range(3)],
        "body_gravity": gravity,
    }
