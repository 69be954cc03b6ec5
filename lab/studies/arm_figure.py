"""Pictures of a joint's median and worst motion."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_simulation import SimulatedMotion
from tendon_newton.data.files.picture import COLOURS, GREY, INK, new_figure, save, tidy
from tendon_newton.data.recording import Array


def draw(
    path: Path,
    joint: int,
    names: Sequence[str],
    motions: Sequence[ArmMotion],
    states: Sequence[SimulatedMotion],
    squares: Sequence[Array],
) -> None:
    """Draw command, measured and predicted angle of a joint in two motions.

    Args:
        path: The picture.
        joint: Its place in the arm.
        names: Of the motions.
        motions: What was measured.
        states: What was predicted.
        squares: Squared errors by motion where they count [rad2].
    """
    order = np.argsort([own.mean() for own in squares])
    figure = new_figure(10.0, 6.0)
    places = {"median": order[len(order) // 2], "worst": order[-1]}
    for axes, (words, k) in zip(figure.subplots(2, 1), places.items(), strict=True):
        time, error = motions[k].recordings[joint].time, 1.0e3 * squares[k].mean() ** 0.5
        lines = (
            ("command", motions[k].commands, GREY),
            ("measured", motions[k].angles, INK),
            ("predicted", states[k].angles, COLOURS[1]),
        )
        for label, angles, colour in lines:
            axes.plot(time, angles[:, joint], color=colour, linewidth=0.9, label=label)
        axes.set_title(f"{words}: {names[k]}, {error:.1f} mrad RMS", loc="left")
        axes.set_ylabel("angle [rad]")
        tidy(axes)
    axes.set_xlabel("time [s]")
    axes.legend(framealpha=1.0, fontsize=9)
    path.parent.mkdir(parents=True, exist_ok=True)
    save(figure, path, dpi=100)
