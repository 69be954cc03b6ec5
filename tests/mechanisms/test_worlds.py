"""Many worlds of one bench, each with its own numbers."""

from collections.abc import Iterator
from dataclasses import replace
from types import FunctionType
from typing import Any

import newton
import numpy as np
import pytest
import warp as wp

from tendon_newton.data.recording import BenchOverrides
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.usd_tendon import register_tendon_attributes
from tendon_newton.mechanisms.worlds import build_model, replicated
from tests.physics.contact.bodies import ball, block, floor

FLOAT32 = 1e-6
NOMINAL = BenchOverrides()


def test_indices_point_into_their_own_world() -> None:
    """World w's moment arms name joints 2w and 2w + 1, tendon w and tip body 2w + 1."""
    rows = build_model(load_mechanism("finger"), 3, device="cpu").tendon
    assert rows.arm_joint.numpy().tolist() == [0, 1, 2, 3, 4, 5]
    assert rows.arm_dof.numpy().tolist() == [0, 1, 2, 3, 4, 5]
    assert rows.arm_tendon.numpy().tolist() == [0, 0, 1, 1, 2, 2]
    assert rows.world.numpy().tolist() == [0, 1, 2]
    assert rows.tip_body.numpy().tolist() == [1, 3, 5]
    assert rows.tip_world.numpy().tolist() == [0, 1, 2]


def test_overrides_change_one_world_and_leave_the_others() -> None:
    """Stiffness, damping, range and moment arm of world 1 are its own."""
    own = BenchOverrides(
        stiffness=(0.09, 0.06), damping=(1e-3, 2e-3), range=(1.0, 0.9), moment_arm=(0.01, 0.004)
    )
    model = build_model(
        load_mechanism("finger"), 3, overrides=[NOMINAL, own, NOMINAL], device="cpu"
    )
    for array, nominal, changed in (
        (model.joint_stiffness, (0.045, 0.030), (0.09, 0.06)),
        (model.joint_damping, (5e-4, 3e-4), (1e-3, 2e-3)),
        (model.joint_limit_upper, (1.75, 1.40), (1.0, 0.9)),
        (model.joint_limit_lower, (0.0, 0.0), (0.0, 0.0)),
        (model.tendon.arm_coef, (0.0080, 0.0055), (0.01, 0.004)),
        (model.mujoco.tendon_coef, (0.0080, 0.0055), (0.01, 0.004)),
    ):
        expected = np.array([nominal, changed, nominal])
        assert array.numpy().reshape(3, 2) == pytest.approx(expected, rel=FLOAT32)


def test_mass_scales_inertia_and_both_inverses() -> None:
    """A heavier link of the same shape has proportionally more inertia."""
    own = BenchOverrides(mass=(0.024, 0.016))
    model = build_model(load_mechanism("finger"), 2, overrides=[NOMINAL, own], device="cpu")
    mass, inertia = model.body_mass.numpy(), model.body_inertia.numpy()
    assert mass[2:] == pytest.approx([0.024, 0.016], rel=FLOAT32)
    assert inertia[2:] == pytest.approx(2.0 * inertia[:2], rel=FLOAT32)
    assert mass * model.body_inv_mass.numpy() == pytest.approx(np.ones(4), rel=FLOAT32)
    unit = np.broadcast_to(np.eye(3), (4, 3, 3))
    assert inertia @ model.body_inv_inertia.numpy() == pytest.approx(unit, abs=1e-5)


def test_length_moves_centre_of_mass_next_joint_and_tip() -> None:
    """A stretched link keeps its proportions; its inertia grows with the square."""
    own = BenchOverrides(length=(0.045, 0.050))
    model = build_model(load_mechanism("finger"), 2, overrides=[NOMINAL, own], device="cpu")
    assert model.body_com.numpy()[2:, 0] == pytest.approx([0.0225, 0.025], rel=FLOAT32)
    assert model.joint_X_p.numpy()[3, :3] == pytest.approx([0.045, 0.0, 0.0], rel=FLOAT32)
    assert model.tendon.tip_point.numpy()[1] == pytest.approx([0.050, 0.0, 0.0], rel=FLOAT32)
    inertia = model.body_inertia.numpy()[:, 1, 1]
    assert inertia[2:] / inertia[:2] == pytest.approx([1.5**2, 2.0**2], rel=FLOAT32)


def test_pendulum_takes_mass_and_arm_from_its_recording() -> None:
    """Two recordings with two loads are two worlds."""
    loads = [BenchOverrides(mass=(m,), length=(L,)) for m, L in ((0.49, 0.10), (0.2, 0.15))]
    model = build_model(load_mechanism("pendulum"), 2, overrides=loads, device="cpu")
    assert model.body_mass.numpy() == pytest.approx([0.49, 0.2], rel=FLOAT32)
    assert model.body_com.numpy()[:, 2] == pytest.approx([-0.10, -0.15], rel=FLOAT32)


def test_empty_overrides_are_the_nominal_model() -> None:
    """An entry that overrides nothing writes back what was there."""
    finger = load_mechanism("finger")
    plain, written = (
        build_model(finger, 2, device="cpu"),
        build_model(finger, 2, overrides=[NOMINAL, NOMINAL], device="cpu"),
    )
    for name in ("body_mass", "body_com", "body_inertia", "joint_X_p", "joint_limit_upper"):
        expected = getattr(plain, name).numpy()
        assert getattr(written, name).numpy() == pytest.approx(expected, rel=FLOAT32, abs=1e-12)


def test_gradients_are_kept_where_asked_for() -> None:
    """``requires_grad`` reaches Newton's arrays and ours, and survives the overrides."""
    own = BenchOverrides(mass=(0.02, 0.01))
    model = build_model(
        load_mechanism("finger"), 1, overrides=[own], requires_grad=True, device="cpu"
    )
    assert model.body_mass.requires_grad
    assert model.joint_stiffness.requires_grad
    assert model.tendon.arm_coef.requires_grad


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        ("finger", [BenchOverrides(mass=(0.012,))], "one value per joint"),
        ("finger", [NOMINAL, NOMINAL], "one entry per world"),
        ("spring_weak", [BenchOverrides(length=(0.1,))], "has no length"),
    ],
)
def test_overrides_that_do_not_fit_are_refused(name: str, overrides: list, message: str) -> None:
    """The error says what does not fit."""
    with pytest.raises(InvalidParameter, match=message):
        build_model(load_mechanism(name), 1, overrides=overrides, device="cpu")


def test_a_model_needs_a_world() -> None:
    """Zero worlds are refused."""
    with pytest.raises(InvalidParameter, match="at least one world"):
        build_model(load_mechanism("finger"), 0, device="cpu")


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
