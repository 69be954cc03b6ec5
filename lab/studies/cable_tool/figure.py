"""Pictures of the median and the worst run of a split."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lab.studies.cable_tool.runs import TO_TORQUE, Run, spindle_torque
from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.root_mean_square import rms
from tendon_newton.identification.study import Residual

INK, FOUND = "#2b2f36", "#d1603d"


def draw(folder: Path, name: str, runs: Sequence[Run], errors: Sequence[Residual]) -> None:
    """Draw torque and jaw over the spindle's angle, measured and predicted."""
    sizes = [rms(e.force[0]) if e.force is not None else 0.0 for e in errors]
    order = np.argsort(sizes)
    figure = new_figure(10.0, 7.0)
    panels = figure.subplots(2, 2)
    for row, (words, k) in zip(
        panels, (("median", order[len(order) // 2]), ("worst", order[-1])), strict=True
    ):
        run, error = runs[k], errors[k]
        assert error.force is not None
        spindle = run.recording.motor_position[:, 0]
        torque, angle = spindle_torque(run.recording), run.recording.compared_angle
        pairs = (
            (torque, torque - TO_TORQUE * error.force[0], "spindle torque [mN m]"),
            (1e3 * (angle - 0.93 * spindle), 1e3 * (angle - error.theta[0] - 0.93 * spindle),
             "jaw less 0.93 spindle [mrad]"),
        )  # fmt: skip
        for axes, (measured, predicted, label) in zip(row, pairs, strict=True):
            axes.plot(spindle, measured, color=INK, linewidth=0.8, label="measured")
            axes.plot(spindle, predicted, color=FOUND, linewidth=0.8, label="predicted")
            axes.set_xlabel("spindle [rad]")
            axes.set_ylabel(label)
            tidy(axes)
        row[0].set_title(
            f"{words}: {run.setting}, {run.frequency:g} Hz, {run.load:g} A", loc="left"
        )
    panels[0][1].legend(frameon=False, fontsize=9)
    folder.mkdir(parents=True, exist_ok=True)
    save(figure, folder / f"cable_tool_{'_'.join(name.replace(',', '').split()[:3])}.png", dpi=100)
