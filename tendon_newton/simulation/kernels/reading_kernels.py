"""Kernels around a control step of many worlds: what is let in, and what is let out."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import DeviceArray, DeviceGrid


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
    body_q: DeviceArray[wp.transformf],
    tip_body: DeviceArray[int],
    tip_point: DeviceArray[wp.vec3f],
    tip: DeviceArray[wp.vec3f],
) -> None:
    """Move each world's tip [m] from its link's frame to the base."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    tip[i] = wp.transform_point(body_q[tip_body[i]], tip_point[i])  # pyright: ignore
