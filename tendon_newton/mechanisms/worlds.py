"""A mechanism replicated over worlds, each with its own numbers."""

from collections.abc import Callable, Sequence
from typing import Any

import newton
import numpy as np
import warp as wp
from numpy.typing import NDArray

from tendon_newton.data.recording import Array, BenchOverrides
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.obstacle_shapes import (
    register_contact_attributes,
    stretch_bones,
    with_shapes,
)
from tendon_newton.mechanisms.usd.usd_tendon import register_tendon_attributes


def build_model(
    mechanism: Mechanism,
    world_count: int,
    *,
    overrides: Sequence[BenchOverrides] | None = None,
    requires_grad: bool = False,
    device: Any = None,
) -> newton.Model:
    """Build one Newton model that holds a mechanism in every world.

    With W worlds, J joints and D tendons the arrays of the model are world by world:
    ``model.body_mass`` (W J,), ``model.joint_stiffness`` (W J,), ``model.tendon.spool_radius`` (W
    D,). The module ``usd_tendon`` lists all of ``model.tendon``. To change a number per world
    later, write its array::

        arms = model.tendon.arm_coef.numpy().reshape(world_count, -1)
        arms[3] *= 1.1  # world 3
        model.tendon.arm_coef.assign(arms.ravel())
        model.tendon.spool_radius.assign(radius_of_each_world)

    Solvers that copy from the model want ``notify_model_changed`` after Newton's own arrays
    were written.

    Args:
        mechanism: What every world holds.
        world_count: Number of worlds W.
        overrides: Bench numbers that differ, one entry per world.
        requires_grad: Whether the arrays carry gradients.
        device: Warp device, the current one by default.

    Raises:
        InvalidParameter: There is no world, or not one entry of overrides per world, or overrides
            come with an obstacle that moves.
    """
    if world_count < 1:
        raise InvalidParameter(f"A model needs at least one world; {world_count} were asked for.")
    if overrides is not None and len(overrides) != world_count:
        raise InvalidParameter(
            f"Overrides need one entry per world; {len(overrides)} came for {world_count} worlds."
        )

    def replicate(count: int) -> newton.Model:
        builder = replicated(mechanism, count)
        # an asset's rules have looked at inertias, and a kernel that does compiles for 0.4 s
        return builder.finalize(
            device=device, requires_grad=requires_grad, skip_validation_inertia=True
        )

    model = model_of_worlds(replicate, world_count)
    if overrides is not None:
        mechanism.refuse_moving_obstacle("a model whose worlds have overrides")
        # Worlds share few distinct entries: in a fit, many candidates replay the same recordings.
        variants = {entry: override_mechanism(mechanism, entry) for entry in set(overrides)}
        _write_variants(model, [variants[entry] for entry in overrides])
        if mechanism.obstacles:
            stretch_bones(model, mechanism.joints, [variants[e].joints for e in overrides])
    return model


def replicated(mechanism: Mechanism, world_count: int) -> newton.ModelBuilder:
    """Return Newton's builder with a mechanism in every world."""
    builder = newton.ModelBuilder()
    register_tendon_attributes(builder)
    template = mechanism.template
    if mechanism.obstacles:
        register_contact_attributes(builder)
        template = with_shapes(mechanism)
    builder.replicate(template, world_count)
    return builder


def _write_variants(model: Any, variants: Sequence[Mechanism]) -> None:
    """Write the numbers of one mechanism per world into a model's arrays."""
    joints = [joint for mechanism in variants for joint in mechanism.joints]
    mass = np.array([joint.mass for joint in joints])
    inertia = np.array([joint.inertia for joint in joints])
    _write(model.body_mass, mass)
    _write(model.body_inv_mass, 1.0 / mass)
    _write(model.body_inertia, inertia)
    _write(model.body_inv_inertia, np.asarray(np.linalg.inv(inertia), dtype=np.float64))
    _write(model.body_com, np.array([joint.center_of_mass for joint in joints]))
    _write(model.joint_stiffness, np.array([joint.stiffness for joint in joints]))
    _write(model.joint_damping, np.array([joint.damping for joint in joints]))
    upper = np.array([joint.limits[1] for joint in joints])
    limits = model.joint_limit_upper.numpy()  # Newton's own number stands where there is none
    model.joint_limit_upper.assign(np.where(np.isfinite(upper), upper, limits).astype(np.float32))
    frames = model.joint_X_p.numpy()
    frames[:, :3] = [joint.parent_position for joint in joints]
    model.joint_X_p.assign(frames)
    tips = [mechanism.tip.point for mechanism in variants if mechanism.tip is not None]
    if tips:
        _write(model.tendon.tip_point, np.array(tips))
    _write_arms(model, variants)
    _write_routes(model, variants)


def _write(target: Any, values: Array) -> None:
    target.assign(values.astype(np.float32))


def _write_arms(model: Any, variants: Sequence[Mechanism]) -> None:
    """Write moment arms for our solvers and for MuJoCo's view of the same tendons."""
    rows = model.tendon
    if not hasattr(rows, "arm_tendon"):  # every tendon is routed
        return
    joint_count = len(variants[0].joints)
    tendon_count = len(variants[0].tendons)
    arms = np.array([[tendon.moment_arm for tendon in m.tendons] for m in variants])
    tendon = rows.arm_tendon.numpy()
    world, column = np.divmod(tendon, tendon_count)
    values = arms[world, column, rows.arm_dof.numpy() % joint_count].astype(np.float32)
    rows.arm_coef.assign(values)
    model.mujoco.tendon_coef.assign(values)


def _write_routes(model: Any, variants: Sequence[Mechanism]) -> None:
    """Write the path points of routed tendons, for our solvers and for MuJoCo's view of them."""
    rows = model.tendon
    if not hasattr(rows, "path_tendon"):
        return
    points = [
        stop.point
        for mechanism in variants
        for tendon in mechanism.tendons
        if tendon.route is not None
        for stop in tendon.route.stops
    ]
    _write(rows.path_point, np.array(points))
    shapes: Any = model.shape_transform
    places = shapes.numpy()
    places[rows.path_shape.numpy(), :3] = np.array(points, dtype=np.float32)
    shapes.assign(places)


FEW = 3  # Up to so many worlds a model is Newton's own
# Fields of a model that have no rows of worlds, and one that `_shapes_of_bodies` makes
DESCRIPTIONS = ("attribute_specs", "attribute_frequency", "attribute_assignment", "body_shapes")


def model_of_worlds(replicate: Callable[[int], newton.Model], world_count: int) -> newton.Model:
    """Return the finalized model of W equal worlds.

    `replicate` makes a model of a few worlds with Newton's builder.
    """
    model: Any = replicate(min(world_count, FEW))
    if world_count > FEW:
        _continue_fields(replicate(FEW - 1), model, world_count - FEW)
        model.body_shapes = _shapes_of_bodies(model)
        leaves = newton.ModelBuilder.BvhConfig()
        model.bvh_build_shapes(
            model, bvh_constructor=leaves.shape_constructor, shape_flags=leaves.shape_flags
        )
    return model


def _continue_fields(two: Any, three: Any, more: int) -> None:
    """Continue the fields of three worlds by further ones, in place: others may refer to them."""
    fields = vars(three)
    for name in fields.keys() - DESCRIPTIONS:
        fields[name] = _continued(getattr(two, name), fields[name], more)


def _continued(two: Any, three: Any, more: int) -> Any:
    """Return a value of three worlds for further ones; what has no rows of worlds stays."""
    if two is three:
        return three
    if isinstance(three, wp.array):
        if len(two) == len(three):
            return three
        rows = _rows(two.numpy(), three.numpy(), more)
        return wp.array(
            rows, dtype=three.dtype, device=three.device, requires_grad=three.requires_grad
        )
    if isinstance(three, np.ndarray):
        return _rows(two, three, more)
    if isinstance(three, list):
        count = len(three) - len(two)
        return three + three[:count] * more
    if isinstance(three, dict):
        return {key: _continued(two[key], value, more) for key, value in three.items()}
    if type(three) is int:
        return three + more * (three - two)
    if type(three).__module__.startswith("newton.") and hasattr(three, "__dict__"):
        _continue_fields(two, three, more)
    return three


def _rows(two: NDArray[Any], three: NDArray[Any], more: int) -> NDArray[Any]:
    """Return the rows of three worlds, of further ones, and what follows the last, such as an end.

    A row in front of all worlds does no harm: steps are those between the last worlds.
    """
    count = len(three) - len(two)
    _, earlier, latest, last = np.split(three, [count, 2 * count, FEW * count])
    further = np.repeat(latest[None], more, axis=0)
    if three.dtype.kind in "iu":
        world = np.arange(1, more + 1, dtype=three.dtype).reshape(-1, *[1] * three.ndim)
        further += world * (latest - earlier)
        last = last + more * (last - two[2 * count :])
    return np.concatenate([three[: FEW * count], further.reshape(-1, *three.shape[1:]), last])


def _shapes_of_bodies(model: Any) -> dict[int, list[int]]:
    """Return the shapes of each body and of the base, -1."""
    shapes: dict[int, list[int]] = {body: [] for body in range(-1, model.body_count)}
    for shape, body in enumerate(model.shape_body.numpy().tolist()):
        shapes[body].append(shape)
    return shapes
