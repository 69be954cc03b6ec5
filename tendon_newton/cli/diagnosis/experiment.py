"""Write the command of the run that tells most about what a diagnosis leaves open.

Commands of the library, and others that are varied, are
simulated on every bench with every set of causes that is left. A set may refit its numbers as far
as the data at hand leave them open. Writes OUT (CSV: t, theta_d), and beside it .toml (bench, and
what is expected) and .png. Record the command on that bench, add the recording to the dataset with
split = "train", and diagnose again. Where one set is left the verb says so and writes nothing.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidOutput, InvalidParameter, NothingToSeparate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.diagnosis.next_experiment.expected_run import Expected


@dataclass(frozen=True, kw_only=True)
class ExperimentConfig:
    """Which diagnosis, which benches, and how long."""

    diagnosis: Annotated[Path, tyro.conf.Positional]  # Folder that the verb diagnose wrote.
    out: Path  # Command file to write, ending in .csv; its folder is made if it is not there.
    benches: tuple[str, ...] = ()
    """Benches that you have; by default those of the data, and for a tendon all of the assets."""
    duration: float = 12.0  # Length of the run [s].
    force_limit: float = 24.0
    """Tension that the run may not reach in simulation [N]; a torque where a shaft is turned."""
    seed: int = 0  # Seed of all draws.


def main(config: ExperimentConfig) -> None:
    """Find the run and write it."""
    check(config)
    quiet_warp()

    import numpy as np

    from tendon_newton.diagnosis.next_experiment.by_hand import best_by_hand
    from tendon_newton.diagnosis.next_experiment.expected_run import Forecast
    from tendon_newton.diagnosis.next_experiment.open_sets_file import read_open_sets
    from tendon_newton.diagnosis.next_experiment.planned_runs import settings_to_try
    from tendon_newton.diagnosis.next_experiment.run_design import LITTLE, design, usual_task
    from tendon_newton.diagnosis.next_experiment.run_files import (
        draw_command,
        write_command,
        write_setting,
    )
    from tendon_newton.workflows.importing import check_bench

    for bench in config.benches:
        check_bench(bench)
    try:
        question, recorded = read_open_sets(config.diagnosis)
    except NothingToSeparate as answer:
        print(answer)
        return
    settings = settings_to_try(recorded, config.benches or None)
    forecast = Forecast(question, usual_task(settings[0], config.duration))
    found = design(
        forecast,
        settings,
        np.random.default_rng(config.seed),
        duration=config.duration,
        force_limit=config.force_limit,
        progress=lambda text: print(f"  {text} ...", flush=True),
    )
    if not found.runs:
        print(
            f"every run that was tried may pull harder than {config.force_limit:g} "
            f"{question.scale.force_unit}, the calmest with {min(found.refused):.3g}; give another "
            "--force-limit if the bench takes more"
        )
        return
    best = found.runs[0]
    if best.told.names < LITTLE:
        print("no run that was tried tells the causes apart: a further sensor may")
    make_folder(config.out.parent, dataset=True)
    write_command(config.out, best.plan)
    write_setting(config.out.with_suffix(".toml"), best)
    draw_command(config.out.with_suffix(".png"), best.plan)
    print(table(found.runs, forecast.entropy))
    if (worth := best_by_hand(forecast)) is not None:
        print(f"\nby hand: {worth.text()}")
    tell_next(config, best)


def check(config: ExperimentConfig) -> None:
    """Refuse what no run can be, before anything is loaded."""
    if not 2.0 <= config.duration <= 120.0:
        raise InvalidParameter(f"--duration must be 2 to 120 s; it is {config.duration:g}")
    if not config.force_limit > 0.0:
        raise InvalidParameter(f"--force-limit must be above 0; it is {config.force_limit:g}")
    if config.out.suffix != ".csv":
        raise InvalidOutput(f"{config.out}: a command file is a CSV file, NAME.csv")


def tell_next(config: ExperimentConfig, best: Expected) -> None:
    """Print which files there are, and what to do with them."""
    for suffix, what in ((".csv", "command"), (".toml", "bench and figures"), (".png", "picture")):
        print(f"  {what:18s} {config.out.with_suffix(suffix)}")
    look = shlex.join(["tendon-newton", "explain", str(config.diagnosis)])
    print(
        f"\nnext: record it on {best.plan.place}, list the log in the dataset with split = "
        '"train" (docs/recordings.md), and diagnose the dataset again'
        f"\n  why the names are open: {look}"
    )


def table(found: Sequence[Expected], entropy: float) -> str:
    """Return the best run of each bench as a table."""
    rows = ["", f"  {entropy:.1f} bits about names are open; expected of the best run of a bench:"]
    rows += [f"  {'bench':16s} {'command':14s} {'names':>6s} {'task':>6s}"]
    rows += [
        f"  {e.plan.place:16s} {e.plan.excitation:14s} {e.told.names:6.2f} {e.told.task:6.2f}"
        for e in found
    ]
    return "\n".join(rows)
