"""The view in space of ``asset show``: links, joint axes, tip path."""

from __future__ import annotations

from typing import Any

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.mechanisms.geometry.kinematics import chain_points, posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import ClosingPath

BONE = "#2b2f36"
AXIS = "#1f6f8b"
TIP = "#d1603d"
STRING = "#3d8361"
MOST_NAMED = 6  # More joints than this [1] are drawn without their names
AXIS_LENGTH = 0.3  # Length of a joint's axis, over that of the whole chain [1], as drawn


def plot_space(axes: Any, mechanism: Mechanism, path: ClosingPath, rows: Indices) -> None:
    """Draw a mechanism in space, ever darker as it closes, with its axes and its tip's path."""
    chains = [chain_points(mechanism, path.joint_position[row]) for row in rows]
    everything = np.concatenate([point for chain in chains for point in chain])
    size = max(float(np.max(np.ptp(everything, axis=0))), 1.0e-3)
    for number, chain in enumerate(chains):
        shade = 0.25 + 0.75 * number / max(len(chains) - 1, 1)
        for bone in chain:
            axes.plot(*(1.0e3 * bone.T), "-o", color=BONE, linewidth=3, markersize=4, alpha=shade)
        for string in strings(mechanism, path.joint_position[rows[number]]):
            axes.plot(*(1.0e3 * string.T), color=STRING, linewidth=1.5, alpha=shade)
    opened = posture(mechanism, path.joint_position[rows[0]])
    for joint, (anchor, axis) in zip(
        mechanism.joints, zip(opened.anchor, opened.axis, strict=True), strict=True
    ):
        reach = 0.5 * AXIS_LENGTH * size * axis
        ends = 1.0e3 * np.array([anchor - reach, anchor + reach])
        axes.plot(*ends.T, color=AXIS, linewidth=1.5)
        if len(mechanism.joints) <= MOST_NAMED:
            axes.text(*ends[1], f" {joint.name}", color=AXIS)
    if path.tip is not None:
        axes.plot(*(1.0e3 * path.tip.T), color=TIP, linewidth=2)
    frame(axes, 1.0e3 * everything, 1.0e3 * size)


def strings(mechanism: Mechanism, joint_position: Array) -> list[Array]:
    """Return the paths of the routed tendons in a posture [m], each shape (N, 3)."""
    routes = [tendon.route for tendon in mechanism.tendons if tendon.route is not None]
    return [route.points(joint_position) for route in routes]


def frame(axes: Any, points: Array, size: float) -> None:
    """Give all three axes the same scale and name them [mm]."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    for setter, center in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        setter(center - 0.6 * size, center + 0.6 * size)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.85)
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_zlabel("z [mm]")
    axes.view_init(elev=18, azim=-65)
    axes.set_title("In space, with the joints' axes")
