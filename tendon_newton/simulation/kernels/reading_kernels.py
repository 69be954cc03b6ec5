"""Kernels around a control step of many worlds: what is let in, and what is let out."""

from __future__ import annotations

import newton
import warp as wp

from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid

REVOLUTE = wp.constant(int(newton.JointType.REVOLUTE))  # Newton's number of a joint that turns


@wp.kernel(enable_backward=False)
def accept_kernel(
    tendons: int,
    asked: DeviceGrid[wp.float32],
    command: DeviceGrid[wp.float32],
    diverged: DeviceArray[wp.bool],
) -> None:
    """Take over each world's command [rad]; one that is not finite marks its world instead."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    fine = bool(True)
    for d in range(tendons):
        if not wp.isfinite(asked[i, d]):
            fine = False
    if fine:
        for d in range(tendons):
            command[i, d] = asked[i, d]
    else:
        diverged[i] = wp.bool(True)


@wp.kernel(enable_backward=False)
def finite_kernel(
    tendons: int,
    angle: DeviceGrid[wp.float32],
    angle_rate: DeviceGrid[wp.float32],
    force: DeviceGrid[wp.float32],
    diverged: DeviceArray[wp.bool],
) -> None:
    """Let no reading out that is not finite: it is 0, and its world is marked."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    for d in range(tendons):
        if not (
            wp.isfinite(angle[i, d]) and wp.isfinite(angle_rate[i, d]) and wp.isfinite(force[i, d])
        ):
            angle[i, d] = wp.float32(0.0)
            angle_rate[i, d] = wp.float32(0.0)
            force[i, d] = wp.float32(0.0)
            diverged[i] = wp.bool(True)


@wp.kernel(enable_backward=False)
def tip_kernel(
    chain: DeviceGrid[int],
    kind: DeviceArray[int],
    parent: DeviceArray[int],
    child: DeviceArray[int],
    at_parent: DeviceArray[wp.transformf],
    at_child: DeviceArray[wp.transformf],
    axis_start: DeviceArray[int],
    axis: DeviceArray[wp.vec3f],
    position_start: DeviceArray[int],
    position: DeviceArray[wp.float32],
    tip_body: DeviceArray[int],
    tip_point: DeviceArray[wp.vec3f],
    body_q: DeviceArray[wp.transformf],
    tip: DeviceArray[wp.vec3f],
) -> None:
    """Place each world's links in the base's frame, and the tip [m] that one of them carries.

    The arithmetic of ``newton.eval_fk`` to the bit, whose module compiles for six seconds.
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    for k in range(chain.shape[1]):
        j = chain[i, k]
        along, moved = axis[axis_start[j]], position[position_start[j]]
        motion = wp.transform_identity(dtype=wp.float32)
        if kind[j] == REVOLUTE:
            turn = wp.quat_from_axis_angle(along, moved)  # pyright: ignore
            motion = wp.transform(wp.vec3(), turn)
        else:
            motion = wp.transform(along * moved, wp.quat_identity())
        anchor = at_parent[j]
        if parent[j] >= 0:
            anchor = body_q[parent[j]] * anchor  # pyright: ignore
        body_q[child[j]] = anchor * motion * wp.transform_inverse(at_child[j])  # pyright: ignore
    tip[i] = wp.transform_point(body_q[tip_body[i]], tip_point[i])  # pyright: ignore
