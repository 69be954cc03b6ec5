"""A picture of docs/lab/xl330.md, ``python -m lab.studies.xl330_figure LOGS``.

Numbers of both models are what the gains 100 and 800 give (`lab.studies.xl330 --test 200`).
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.studies.so101_figure import AFTER, BEFORE, GREY, INK, dress
from tendon_lab.foreign_logs.bam import read_xl330
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.identification.study import Study

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "xl330.png"
FRICTION = (
    {"torque_constant": 0.297, "resistance": 3.70, "armature": 0.00185},
    {
        "load_dependent_friction": {"coefficient": 0.440},
        "viscous_friction": {"coefficient": 0.00705},
    },
)
FADING = (
    {"torque_constant": 0.375, "resistance": 3.29, "armature": 0.00199},
    {
        "load_dependent_friction": {"coefficient": 0.407},
        "viscous_friction": {"coefficient": 0.00736},
        "torque_fade": {"fade": 3.61, "time_constant": 0.713},
    },
)
SHOWN = (
    ("kp200_sin_sin.csv", "gain 200, which no fit has seen"),
    ("kp800_up_and_down.csv", "gain 800: half of the rows at full duty"),
)


def main() -> None:
    """Draw two logs with what both models make of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    imported = read_xl330(parser.parse_args().logs)
    logs = {log.recording.name: log.recording for log in imported.logs}
    figure = new_figure(10.5, 3.9)
    for axes, (name, title) in zip(figure.subplots(1, 2), SHOWN, strict=True):
        draw(axes, logs[name], imported.model)
        axes.set_title(f"{name.removesuffix('.csv')}: {title}", fontsize=10)
        dress(axes, "time [s]", "angle [rad]")
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    save(figure, PICTURE, dpi=120)


def draw(axes: Any, recording: Recording, start: Model) -> None:
    """Draw one log."""
    assert recording.command is not None
    time = recording.time - recording.time[0]
    axes.plot(time, recording.command[:, 0], color=GREY, linewidth=1.0, label="told")
    axes.plot(
        time, recording.motor_position[:, 0], color=INK, alpha=0.45, linewidth=4, label="measured"
    )
    for (motor, effects), color, label in (
        (FRICTION, BEFORE, "friction"),
        (FADING, AFTER, "friction, and torque that fades"),
    ):
        model = replace(
            start,
            actuator=replace(start.actuator, values={**start.actuator.values, **motor}),
            effects=tuple(NamedValues(name=n, values=values) for n, values in effects.items()),
        )
        (simulated,) = Study([recording], model, tuple(effects)).trajectories({})
        axes.plot(time, simulated.motor_position[:, 0], color=color, label=label)


if __name__ == "__main__":
    main()
