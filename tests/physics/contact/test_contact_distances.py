"""How deep links are in obstacles, against a thousand points by hand."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid, Mat33, Vec3, real
from tendon_newton.device_code.templates import Bindings, device_template
from tendon_newton.mechanisms.geometry.obstacles import Box, Obstacle, Plane, Sphere
from tendon_newton.simulation.contact.contact_distances import TILT, overlap_at
from tendon_newton.simulation.contact.contact_plan import BETWEEN, END, SHAPES, START, ContactPlan
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.structure import Structure
from tests.physics.contact.contacts import deepest


@device_template
def overlap_kernel(
    ends: DeviceGrid[Vec3],
    radius: real,
    spot: int,
    place: Vec3,
    frame: Mat33,
    size: Vec3,
    shape: int,
    depth: DeviceArray[real],
    normal: DeviceArray[Vec3],
) -> None:
    """Write how deep capsules are, one a thread."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    found = overlap_at(ends[i, 0], ends[i, 1], radius, spot, place, frame, size, shape)
    depth[i] = found.depth
    normal[i] = found.normal


@cache
def overlap_program() -> tuple[Bindings, wp.Kernel]:
    """Compile the distances alone."""
    structure = Structure(
        parents=(-1,),
        revolute=(True,),
        tendon_count=1,
        actuator="ideal",
        effects=(),
        touch=ContactPlan(links=(0,), shapes=SHAPES),
    )
    assembly = assemble(structure)
    return assembly.types, assembly.kernel(overlap_kernel)


def depths(obstacle: Obstacle, ends: Array, radius: float, spot: int) -> tuple[Array, Array]:
    """Return depths [m] and normals of capsules with axes from and to, shape (N, 2, 3)."""
    types, kernel = overlap_program()
    vector, square = types[Vec3], types[Mat33]
    depth = wp.zeros(len(ends), dtype=wp.float64, device="cpu")
    normal = wp.zeros(len(ends), dtype=vector, device="cpu")
    inputs = [
        wp.array(ends, dtype=vector, device="cpu"),
        radius,
        spot,
        vector(*obstacle.position),
        square(*obstacle.rotation.ravel()),
        vector(*obstacle.size),
        SHAPES.index(obstacle.shape),
    ]
    outputs: list[Any] = [depth, normal]
    wp.launch(kernel, len(ends), inputs=inputs, outputs=outputs, device="cpu")
    return outputs[0].numpy(), outputs[1].numpy()


def turned(rng: np.random.Generator) -> Array:
    """Return a random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def random_obstacle(shape: str, rng: np.random.Generator) -> Obstacle:
    """Return an obstacle of a size like a phalanx, anyhow turned."""
    position = rng.normal(size=3) * 0.01
    if shape == "sphere":
        return Sphere(position=position, radius=rng.uniform(0.004, 0.02))
    if shape == "box":
        return Box(position=position, half_size=rng.uniform(0.004, 0.02, 3), turn=turned(rng))
    return Plane(position=position, normal=rng.normal(size=3))


@pytest.mark.parametrize("shape", SHAPES)
def test_the_deepest_point_of_a_link_counts(shape: str, rng: np.random.Generator) -> None:
    """The depths of a capsule's contacts add up to that of its deepest point, from any side.

    That point is sought among a thousand of the axis.
    """
    for _ in range(10):
        obstacle = random_obstacle(shape, rng)
        ends = rng.normal(size=(40, 2, 3)) * 0.02
        spots = {spot: depths(obstacle, ends, 0.004, spot)[0] for spot in (START, END, BETWEEN)}
        found = np.maximum(np.maximum(spots[START], spots[END]), 0.0)
        if shape == "sphere":
            found = np.maximum(spots[BETWEEN], 0.0)
        if shape == "box":
            found = found + np.maximum(spots[BETWEEN], 0.0)
        sought = [max(0.0, deepest(obstacle, a, b, 0.004, 1001)) for a, b in ends]
        # points are half a step apart at most; the middle is preferred as by a tilt of TILT
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)
        assert np.all(np.abs(found - sought) <= (5e-4 + 0.25 * TILT) * length)


def test_a_normal_is_the_slope_of_the_depth(rng: np.random.Generator) -> None:
    """Moving a capsule along the normal takes as much off its depth; it points outwards."""
    for shape, spot in (("sphere", BETWEEN), ("box", END), ("plane", START)):
        obstacle = random_obstacle(shape, rng)
        ends = rng.normal(size=(30, 2, 3)) * 0.02
        before, normal = depths(obstacle, ends, 0.004, spot)
        after, _ = depths(obstacle, ends + 1e-7 * normal[:, None, :], 0.004, spot)
        # 1e-6 m: an edge of the box may lie in between
        assert (before - after) / 1e-7 == pytest.approx(1.0, abs=1e-4)
