"""Where two links come closest, against hand geometry, and without jumps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid, Vec2, Vec3, real
from tendon_newton.device_code.templates import Bindings, device_template
from tendon_newton.simulation.contact.contact_distances import TILT
from tendon_newton.simulation.contact.link_contacts import nearest_shares
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.structure import Structure
from tests.physics.contact.pinches import nearest

REACH = 0.0075
"""Distance at which two phalanges touch [m]."""
LENGTH = 0.025
"""Length of their axes [m]."""


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
