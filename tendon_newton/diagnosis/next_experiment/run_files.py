"""A proposed run as files: its command, where to record it, and what it is expected to show."""

import csv
from pathlib import Path

from tendon_newton.data.files.picture import COLOURS, GREY, INK, new_figure, save, tidy
from tendon_newton.data.files.toml_file import write_toml
from tendon_newton.diagnosis.next_experiment.expected_run import Expected
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan


def write_command(path: Path, plan: Plan) -> None:
    """Write the command as CSV: ``t`` [s] and ``theta_d`` [rad], held until the next row.

    Each of several servos has its column, ``theta_d_0`` and so on.
    """
    names = [f"theta_d_{d}" for d in range(plan.servos)] if plan.servos > 1 else ["theta_d"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("t", *names))
        writer.writerows(
            (f"{t:.6f}", *(f"{c:.6f}" for c in row))
            for t, row in zip(plan.time, plan.commands, strict=True)
        )


def write_setting(path: Path, expected: Expected) -> None:
    """Write which command to record on which bench, and what is expected of it, as TOML."""
    table = expected.plan.setting.to_json()
    del table["seconds"]
    told = {"names": expected.told.names, "task": expected.told.task}
    write_toml(
        path,
        {
            "command": path.with_suffix(".csv").name,
            **table,
            "expected_bits": {key: round(bits, 3) for key, bits in told.items()},
        },
    )


def draw_command(path: Path, plan: Plan) -> None:
    """Draw the command of a run.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    figure = new_figure(6.0, 3.2)
    axes = figure.subplots()
    axes.step(plan.time, plan.command, where="post", color=COLOURS[0], linewidth=1.4)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("commanded angle [rad]")
    title = f"{plan.excitation.replace('_', ' ')} on {plan.place}"
    axes.set_title(title, loc="left", fontsize=10, color=INK)
    tidy(axes)
    axes.tick_params(colors=GREY, labelcolor=INK)
    save(figure, path, dpi=130)
