"""A mechanism replicated over worlds, each with its own numbers."""

from collections.abc import Sequence
from typing import Any

import newton
import numpy as np

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
from tendon_newton.mechanisms.world_series import model_of_worlds


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
    _write_upper_limits(model, np.array([joint.limits[1] for joint in joints]))
    frames = model.joint_X_p.numpy()
    frames[:, :3] = [joint.parent_position for joint in joints]
    model.joint_X_p.assign(frames)
    _write_tips(model, variants)
    _write_arms(model, variants)
    _write_routes(model, variants)


def _write(target: Any, values: Array) -> None:
    target.assign(values.astype(np.float32))


def _write_upper_limits(model: Any, upper: Array) -> None:
    """Write the upper limits; Newton's own large number stands for a joint without one."""
    limits = model.joint_limit_upper.numpy()
    finite = np.isfinite(upper)
    limits[finite] = upper[finite]
    model.joint_limit_upper.assign(limits)


def _write_tips(model: Any, variants: Sequence[Mechanism]) -> None:
    tips = [mechanism.tip.point for mechanism in variants if mechanism.tip is not None]
    if tips:
        _write(model.tendon.tip_point, np.array(tips))


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
