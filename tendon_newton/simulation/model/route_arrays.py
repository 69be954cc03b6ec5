"""The numbers of routed tendons as our kernels read them: per world, in the axes of the base."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.mechanisms.geometry.routing import Pulley, span_length
from tendon_newton.simulation.chains.rotations import rotation_matrices
from tendon_newton.simulation.model.route_plan import NO_PULLEY, NO_ROUTES, RoutePlan, plan_of


@dataclass(frozen=True, kw_only=True)
class RouteNumbers:
    """Path points of every world, with the chain at q = 0."""

    # From the joint that moves each point to it [m], shape (W, N, 3); on the base its place
    point: Array
    frame: Array  # From a pulley's frame, axis along z, to the base, shape (W, N, 3, 3)
    radius: Array  # Radius of a pulley [m], 0 for a site, shape (W, N)
    turn: Array  # Which way round it the string goes, +1 or -1, shape (W, N)
    rest_length: Array  # Length of each tendon at q = 0 [m], 0 without a path, shape (W, D)


def read_plan(model: Any, moved_by: dict[int, int]) -> RoutePlan:
    """Return the routes that all worlds of a model share.

    `moved_by` gives the joint of the first world that moves each of its bodies.
    """
    rows = model.tendon
    if not hasattr(rows, "path_tendon"):  # Newton keeps no columns without rows
        return NO_ROUTES
    tendons = rows.path_tendon.numpy().tolist()
    count = len(tendons) // model.world_count
    bodies = [moved_by.get(body, -1) for body in rows.path_body.numpy().tolist()[:count]]
    return plan_of(tendons[:count], bodies, rows.path_radius.numpy().tolist()[:count])


def read_numbers(model: Any, plan: RoutePlan, frames: Any, tendon_count: int) -> RouteNumbers:
    """Return the numbers of a model's routes."""
    rows, shape = model.tendon, (model.world_count, len(plan.bodies))
    own = rows.path_point.numpy().astype(np.float64).reshape(*shape, 3)
    turned = rotation_matrices(rows.path_rotation.numpy().astype(np.float64).reshape(*shape, 4))
    bodies = np.array(plan.bodies)
    carried = bodies >= 0
    point, frame = own.copy(), turned.copy()
    rotation = frames.body_rotation[:, bodies]
    from_joint = np.einsum("wnab,wnb->wna", rotation, own) + frames.body_position[:, bodies]
    point[:, carried] = (from_joint - frames.origin[:, bodies])[:, carried]
    frame[:, carried] = (rotation @ turned)[:, carried]
    place = point + np.where(carried[:, None], frames.origin[:, bodies], 0.0)
    radius = rows.path_radius.numpy().astype(np.float64).reshape(shape)
    turn = rows.path_turn.numpy().astype(np.float64).reshape(shape)
    return RouteNumbers(
        point=point,
        frame=frame,
        radius=radius,
        turn=turn,
        rest_length=_rest_lengths(plan, place, frame, radius, turn, tendon_count),
    )


def _rest_lengths(
    plan: RoutePlan, place: Array, frame: Array, radius: Array, turn: Array, tendon_count: int
) -> Array:
    """Return the length of each tendon with all points in their places [m], shape (W, D)."""
    worlds = len(place)
    numbers = np.concatenate(
        [place.reshape(worlds, -1), frame.reshape(worlds, -1), radius, turn], axis=1
    )
    first: Indices
    _, first, inverse = np.unique(numbers, axis=0, return_index=True, return_inverse=True)
    lengths = np.zeros((len(first), tendon_count))
    for row, world in enumerate(first):
        for span in plan.spans:
            start, end = place[world, span.start], place[world, span.end]
            pulley, k = None, span.pulley
            if k != NO_PULLEY:
                axes = frame[world, k]
                start, end = ((site - place[world, k]) @ axes for site in (start, end))
                pulley = Pulley(
                    prim="",
                    body=-1,
                    point=place[world, k],
                    rotation=axes,
                    radius=float(radius[world, k]),
                    side=place[world, k],
                    turn=float(turn[world, k]),
                )
            lengths[row, span.tendon] += span_length(start, end, pulley)[0]
    return lengths[inverse.ravel()]
