"""How deep links are in obstacles, against a thousand points by hand."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid, Mat33, Vec2, Vec3, real
from tendon_newton.device_code.templates import Bindings, device_template
from tendon_newton.mechanisms.geometry.obstacles import Box, Obstacle, Plane, Sphere
from tendon_newton.simulation.contact.contact_distances import TILT, overlap_at
from tendon_newton.simulation.contact.contact_plan import BETWEEN, END, SHAPES, START, ContactPlan
from tendon_newton.simulation.contact.link_contacts import nearest_shares
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.structure import Structure
from tests.physics.contact.bodies import deepest
from tests.physics.contact.pinches import nearest


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


REACH = 0.0075  # Distance at which two phalanges touch [m]
LENGTH = 0.025  # Length of their axes [m]


@device_template
def shares_kernel(ends: DeviceGrid[Vec3], reach: real, share: DeviceArray[Vec2]) -> None:
    """Write where two axes come closest, a pair a thread."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    axis = ends[i, 1] - ends[i, 0]
    other = ends[i, 3] - ends[i, 2]
    share[i] = nearest_shares(ends[i, 0] - ends[i, 2], axis, other, reach)


@cache
def shares_program() -> tuple[Bindings, wp.Kernel]:
    """Compile the closest points alone."""
    assembly = assemble(
        Structure(parents=(-1,), revolute=(True,), tendon_count=1, actuator="ideal", effects=())
    )
    return assembly.types, assembly.kernel(shares_kernel)


def shares(ends: Array) -> Array:
    """Return where axes from and to, shape (N, 4, 3), come closest, 0 to 1 along each, (N, 2)."""
    types, kernel = shares_program()
    found = wp.zeros(len(ends), dtype=types[Vec2], device="cpu")
    given = wp.array(ends, dtype=types[Vec3], device="cpu")
    wp.launch(kernel, len(ends), inputs=[given, REACH], outputs=[found], device="cpu")
    return np.asarray(found.numpy())


def gap(ends: Array, share: Array) -> float:
    """Return how far apart two axes are at a place of each [m]."""
    first = ends[0] + share[0] * (ends[1] - ends[0])
    second = ends[2] + share[1] * (ends[3] - ends[2])
    return float(np.linalg.norm(first - second))


def test_two_links_meet_where_they_come_closest(rng: np.random.Generator) -> None:
    """Ends, or points between them, from any side."""
    ends = rng.normal(size=(2000, 4, 3)) * 0.02
    found = shares(ends)
    for pair, share in zip(ends, found, strict=True):
        here, there = nearest(pair[:2], pair[2:])
        crossing = np.cross(pair[1] - pair[0], pair[3] - pair[2])
        lengths = [float(np.linalg.norm(pair[k + 1] - pair[k])) for k in (0, 2)]
        sine = float(np.linalg.norm(crossing)) / (lengths[0] * lengths[1])
        if sine**2 > TILT * REACH / min(lengths):  # nearly parallel ones prefer their middles
            assert gap(pair, share) == pytest.approx(np.linalg.norm(here - there), abs=1e-12)


def lying(tilt: float) -> Array:
    """Return two equal links one above the other, of which the upper is tilted [rad]."""
    half = 0.5 * LENGTH * np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    up = np.array([0.0, 0.0, REACH])
    flat = np.array([0.5 * LENGTH, 0.0, 0.0])
    return np.array([up - half, up + half, -flat, flat])


def test_links_that_lie_on_each_other_meet_in_their_middles() -> None:
    """As one of them tilts, the place wanders to its end within some angles of `TILT`."""
    tilts = np.linspace(-3.0 * TILT, 3.0 * TILT, 601)
    found = shares(np.array([lying(tilt) for tilt in tilts]))
    assert found[300] == pytest.approx([0.5, 0.5], abs=1e-12)
    assert found[0] == pytest.approx([1.0, 1.0], abs=0.01)
    assert found[-1] == pytest.approx([0.0, 0.0], abs=0.01)
    assert np.max(np.abs(np.diff(found, axis=0))) < 0.02  # nowhere a jump


def test_lying_links_are_as_deep_as_their_closest_points() -> None:
    """The preference for the middles takes nothing off that matters."""
    tilts = np.linspace(-3.0 * TILT, 3.0 * TILT, 61)
    ends = np.array([lying(tilt) for tilt in tilts])
    for pair, share in zip(ends, shares(ends), strict=True):
        here, there = nearest(pair[:2], pair[2:])
        closest = float(np.linalg.norm(here - there))
        # the middle is preferred as by a tilt of TILT
        assert 0.0 <= gap(pair, share) - closest + 1e-12 <= 0.5 * TILT * LENGTH
