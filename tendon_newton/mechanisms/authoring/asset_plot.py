"""``asset show``: one picture of how a mechanism closes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.recording import Array, Indices
from tendon_newton.errors import InvalidOutput
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.kinematics import chain_points, posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion, moment_arms
from tendon_newton.mechanisms.geometry.statics import ClosingPath, closing_path
from tendon_newton.mechanisms.rules.mechanism_rules import range_positions

COLORS = ("#1f6f8b", "#d1603d", "#6a4c93", "#3d8361", "#b8860b", "#555555")
GREY = "#8a8f98"
INK = "#2b2f36"
POSTURES = 5
DASHES = ("-", "--", ":", "-.")  # Line style of each tendon
NO_ARM = 1.0e-6  # A moment arm smaller than this [m] all along is none


def plot_asset(mechanism: Mechanism, path: Path) -> None:
    """Draw excursion, moment arms, closing force and postures, flat and in space, as PNG."""
    if path.suffix.lower() != ".png":
        raise InvalidOutput(f"The picture is a PNG file; {path} ends otherwise.")
    figure = new_figure(15.5, 7.5)
    grid = figure.add_gridspec(2, 3)
    top_left, top_right = (figure.add_subplot(grid[0, column]) for column in (0, 1))
    low_left, low_right = (figure.add_subplot(grid[1, column]) for column in (0, 1))
    closing = closing_path(mechanism)
    # five postures from slack to closed, at equal steps of the tendon
    steps = np.linspace(closing.excursion[0], closing.excursion[-1], POSTURES)
    rows = np.minimum(np.searchsorted(closing.excursion, steps), len(closing.tension) - 1)
    space = figure.add_subplot(grid[:, 2], projection="3d")
    plot_space(space, mechanism, closing, rows[[0, 2, 4]])
    _plot_excursion(top_left, mechanism)
    _plot_arms(top_right, mechanism)
    _plot_force(low_left, mechanism, closing)
    _plot_postures(low_right, mechanism, closing, rows)
    for axes in (top_left, top_right, low_left, low_right):
        tidy(axes)
    figure.suptitle(_title(mechanism), fontsize=13)
    save(figure, path, dpi=130)


def _title(mechanism: Mechanism) -> str:
    if len(mechanism.joints) > MOST_NAMED:
        counts = f"{len(mechanism.joints)} joints, {len(mechanism.tendons)} tendons"
        return f"{mechanism.name}:  {counts}"
    joints = ", ".join(f"{j.name} ({j.kind}, {_range(j)})" for j in mechanism.joints)
    return f"{mechanism.name}:  {joints}"


def _range(joint: Joint) -> str:
    lower, upper = joint.limits
    if not np.isfinite(upper):
        return "no limits"
    return f"{lower:.3g} to {upper:.3g} {_unit(joint)}"


def _unit(joint: Joint) -> str:
    return "rad" if joint.kind == "revolute" else "m"


def _force_unit(mechanism: Mechanism) -> str:
    return "N m" if mechanism.tendons[0].direct else "N"


def _sweep(mechanism: Mechanism, joint: int) -> Array:
    """Return 61 positions with one joint over its range and the others open, shape (61, J)."""
    positions = range_positions(mechanism, 61)
    others = [j for j in range(positions.shape[1]) if j != joint]
    positions[:, others] = positions[0, others]
    return positions


def _plot_excursion(axes: Any, mechanism: Mechanism) -> None:
    unit, scale = ("rad", 1.0) if mechanism.tendons[0].direct else ("mm", 1.0e3)
    _plot_by_joint(axes, mechanism, lambda tendon, q, _: scale * excursion(tendon, q))
    axes.set(title="Excursion, one joint at a time", ylabel=f"tendon wound in, l [{unit}]")


def _plot_arms(axes: Any, mechanism: Mechanism) -> None:
    plain = mechanism.tendons[0].direct or "prismatic" in mechanism.joint_kinds
    unit, scale = ("1", 1.0) if plain else ("mm", 1.0e3)
    _plot_by_joint(axes, mechanism, lambda tendon, q, j: scale * moment_arms(tendon, q)[:, j])
    top = max(float(np.max(np.abs(line.get_ydata()))) for line in axes.lines)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]), top=1.2 * top)
    axes.set(title="Moment arm, positive closes", ylabel=f"dl/dq [{unit}]")


def _plot_by_joint(
    axes: Any, mechanism: Mechanism, value: Callable[[Tendon, Array, int], Array]
) -> None:
    """Draw a value of each tendon while one joint moves over its range and the others are open.

    Joints that it moves, or all where it moves none.
    """
    for d, tendon in enumerate(mechanism.tendons):
        arms = moment_arms(tendon, range_positions(mechanism, 5))
        moved = np.flatnonzero(np.max(np.abs(arms), axis=0) > NO_ARM).tolist()
        for j in moved or range(len(mechanism.joints)):
            positions = _sweep(mechanism, j)
            name = mechanism.joints[j].name
            if len(mechanism.tendons) > 1:
                name = f"{tendon.name}, {name}"
            style = {"color": COLORS[j % 6], "linewidth": 2, "label": name}
            axes.plot(positions[:, j], value(tendon, positions, j), DASHES[d % 4], **style)
    axes.set_xlabel(f"joint position q [{_unit(mechanism.joints[0])}]")
    _name_curves(axes)


def _name_curves(axes: Any, **options: Any) -> None:
    """Add a legend where it does not hide the picture."""
    if len(axes.get_legend_handles_labels()[0]) <= MOST_NAMED:
        axes.legend(frameon=False, **options)


def _plot_force(axes: Any, mechanism: Mechanism, path: ClosingPath) -> None:
    """Draw the force that holds the mechanism at rest, and where its joints are then."""
    tendon = mechanism.tendons[0]
    unit = _force_unit(mechanism)
    theta = path.excursion / tendon.spool_radius
    quantity = "torque" if tendon.direct else "tension"
    axes.plot(theta, path.tension, color=INK, linewidth=2.5, label=quantity)
    axes.set(xlabel="motor angle theta [rad]", ylabel=f"{quantity} [{unit}]")
    axes.set_title("Holding it closed: no friction, no motion")
    if path.tension[-1] > 0.4 * tendon.force_limit:
        axes.axhline(tendon.force_limit, color=GREY, linestyle="--", linewidth=1.2)
        axes.annotate(
            f"servo limit {tendon.force_limit:g} {unit}",
            (theta[0], tendon.force_limit),
            xytext=(2, -12),
            textcoords="offset points",
            color=GREY,
        )
    if len(mechanism.joints) == 1:  # its joint moves with theta: nothing new to see
        return
    twin = axes.twinx()
    for j, joint in enumerate(mechanism.joints):
        style = {"color": COLORS[j % 6], "linewidth": 1.5, "linestyle": "--", "label": joint.name}
        twin.plot(theta, path.joint_position[:, j], **style)
    twin.set_ylabel(f"joint position q [{_unit(mechanism.joints[0])}], dashed")
    twin.spines["top"].set_visible(False)
    _name_curves(twin, loc="lower right")


def _plot_postures(axes: Any, mechanism: Mechanism, path: ClosingPath, rows: Indices) -> None:
    """Draw five postures, of a finger from the side and of a slider as a bar."""
    if "prismatic" in mechanism.joint_kinds:
        _plot_travel(axes, path, rows)
        axes.set(
            ylabel=f"tension [{_force_unit(mechanism)}]",
            title="Travel of the slider, slack to closed",
        )
    else:
        _plot_links(axes, mechanism, path, rows)
        axes.set(ylabel="z [mm]", title="Postures and path of the tip, slack to closed")
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")


def _plot_travel(axes: Any, path: ClosingPath, rows: Indices) -> None:
    """Draw one line per posture of a slider, lowest tension on top."""
    for line, k in enumerate(rows):
        x = 1.0e3 * path.joint_position[k, 0]
        axes.plot([0.0, x], [line, line], color=GREY, linewidth=2)
        axes.plot([x], [line], "s", color=COLORS[0], markersize=14)
    axes.set_yticks(range(len(rows)), [f"{path.tension[k]:.3g}" for k in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)


def _plot_links(axes: Any, mechanism: Mechanism, path: ClosingPath, rows: Indices) -> None:
    """Draw the links seen along +y: x to the right, z up."""
    for line, k in enumerate(rows):
        q = path.joint_position[k]
        shade = 0.25 + 0.75 * line / (len(rows) - 1)
        for bone in chain_points(mechanism, q):
            style = {"linewidth": 3, "markersize": 5, "solid_capstyle": "round"}
            axes.plot(*(1.0e3 * bone[:, [0, 2]].T), "-o", color=INK, alpha=shade, **style)
        for string in strings(mechanism, q):
            axes.plot(*(1.0e3 * string[:, [0, 2]].T), color=STRING, linewidth=1.2, alpha=shade)
    if path.tip is not None:
        tip = 1.0e3 * path.tip[:, [0, 2]].T
        axes.plot(*tip, color=COLORS[1], linewidth=2, label="path of the tip")
        axes.legend(frameon=False)


AXIS, TIP, STRING = COLORS[0], COLORS[1], COLORS[3]
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
            axes.plot(*(1.0e3 * bone.T), "-o", color=INK, linewidth=3, markersize=4, alpha=shade)
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
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.view_init(elev=18, azim=-65)
    axes.set_title("In space, with the joints' axes")
