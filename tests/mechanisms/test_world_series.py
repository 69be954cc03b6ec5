"""A model of many worlds is what Newton's builder would have made, field by field."""

from collections.abc import Iterator
from dataclasses import replace
from types import FunctionType
from typing import Any

import newton
import numpy as np
import pytest
import warp as wp

from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.usd_tendon import register_tendon_attributes
from tendon_newton.mechanisms.worlds import build_model, replicated
from tests.physics.contact.contacts import ball, block, floor

LEAVES = ("bvh_shape_enabled", "_bvh_shape_active_leaves")
"""Fields of which Newton leaves unset what lies behind its count of leaves."""
OPAQUE = (FunctionType, wp.Bvh, wp.Device)
"""Types without fields to compare; a tree is built from arrays that are compared."""


def differences(ours: Any, newtons: Any, place: str = "model") -> Iterator[str]:
    """Name every field in which two models differ, private ones too."""
    if type(ours) is not type(newtons):
        yield place
    elif isinstance(ours, wp.array):
        for name in ("dtype", "shape", "strides", "device", "requires_grad"):
            if getattr(ours, name) != getattr(newtons, name):
                yield f"{place}.{name}"
        yield from differences(ours.numpy(), newtons.numpy(), place)
    elif isinstance(ours, np.ndarray):
        if ours.dtype != newtons.dtype or not np.array_equal(ours, newtons):
            yield place
    elif isinstance(ours, dict):
        if ours.keys() != newtons.keys():
            yield f"keys of {place}"
        for key in ours.keys() & newtons.keys():
            yield from differences(ours[key], newtons[key], f"{place}[{key!r}]")
    elif isinstance(ours, list | tuple):
        if len(ours) != len(newtons):
            yield f"length of {place}"
        for number, pair in enumerate(zip(ours, newtons, strict=False)):
            yield from differences(*pair, f"{place}[{number}]")
    elif isinstance(ours, OPAQUE):
        return
    elif type(ours).__module__.startswith(("newton", "warp")):
        yield from differences(fields_of(ours), fields_of(newtons), place)
    elif ours is not newtons and ours != newtons:
        yield place


def fields_of(thing: Any) -> dict[str, Any]:
    """Return what an object of Newton's holds, without what it left unset."""
    fields = dict(getattr(thing, "__dict__", {}))
    for name in LEAVES:
        if fields.get(name) is not None:
            fields[name] = fields[name].numpy()[: thing.bvh_shape_count_enabled]
    return fields


def with_mesh(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose first link carries a mesh."""
    template = newton.ModelBuilder()
    register_tendon_attributes(template)
    template.add_builder(mechanism.template)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    template.add_shape_mesh(0, mesh=newton.Mesh(corners, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]))
    return replace(mechanism, template=template)


def check(mechanism: Mechanism, world_count: int, *, requires_grad: bool = False) -> None:
    """Compare a mechanism's model with the one that Newton's builder makes."""
    ours = build_model(mechanism, world_count, requires_grad=requires_grad, device="cpu")
    newtons = replicated(mechanism, world_count)
    newtons = newtons.finalize(device="cpu", requires_grad=requires_grad)
    assert list(differences(ours, newtons)) == []


@pytest.mark.parametrize("name", asset_names())
@pytest.mark.parametrize("world_count", [1, 2, 5])
def test_every_field_is_as_newton_makes_it(name: str, world_count: int) -> None:
    """Arrays, counts, labels, pairs that may touch: all worlds, every asset."""
    check(load_mechanism(name), world_count)


@pytest.mark.parametrize("world_count", [4, 11])
def test_obstacles_meshes_and_gradients_are_continued(world_count: int) -> None:
    """Shapes that may touch, of the base and on links, and arrays with gradients."""
    bench = load_mechanism("finger").with_obstacles(ball(), block(), floor())
    check(with_mesh(bench), world_count, requires_grad=True)


def test_a_difference_is_seen() -> None:
    """A wrong index, count, label or pair is named."""
    bench = load_mechanism("finger")
    ours: Any = build_model(bench, 5, device="cpu")
    newtons = replicated(bench, 5).finalize("cpu")
    ours.tendon.arm_dof.assign(ours.tendon.arm_dof.numpy() + 1)
    ours.joint_count += 1
    ours.joint_label[3] = "other"
    ours.body_shapes[2] = [7]
    assert sorted(differences(ours, newtons)) == [
        "model['body_shapes'][2][0]",
        "model['joint_count']",
        "model['joint_label'][3]",
        "model['tendon']['arm_dof']",
    ]
