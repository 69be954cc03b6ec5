"""Design the runs to record before there are any data, and tell which numbers they will show.

The model file names what is suspected: effects with likely values, and numbers of the actuator
under fit. Each run is designed for what the runs before it leave open. Numbers that no run tells
are listed: with these benches nobody can find them.

Example: tendon-newton plan model.toml --benches finger --budget 1min --out plan

OUT gets run_1.csv, run_2.csv, ... (t, theta_d), each with its bench in a .toml beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from tendon_newton.diagnosis.next_experiment.first_plan import FirstPlan


@dataclass(frozen=True, kw_only=True)
class PlanConfig:
    """Which model, which benches, how long."""

    model: Annotated[Path, tyro.conf.Positional]
    """Model file with the effects that are suspected, or a known servo."""
    out: Path  # Folder for the commands; made if it is not there.
    benches: tuple[str, ...] = ("finger", "spring_weak", "spring_strong")  # Benches that you have.
    task: Path | None = None
    """Recording, or CSV file with t and theta_d, whose motion a model shall predict. By default
    steps to random angles on the first bench."""
    budget: str = "1min"  # Time that all runs together may take: 90s, 3min.
    run_length: float = 12.0  # Length of a run [s].
    force_limit: float = 24.0
    """Tension that no run may reach in simulation [N]; a torque where a shaft is turned [N m]."""
    seed: int = 0  # Seed of all draws.


def main(config: PlanConfig) -> None:
    """Design the runs, write them and say what they tell."""
    from tendon_newton.cli.duration import read_duration
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.device_code.quiet import quiet_warp
    from tendon_newton.diagnosis.diagnosed_bench import open_model
    from tendon_newton.diagnosis.next_experiment.designed_command import check_run_length
    from tendon_newton.errors import InvalidModelFile, InvalidParameter
    from tendon_newton.mechanisms.loading import load_mechanism

    check_run_length(config.run_length)
    runs = int(read_duration(config.budget, "--budget") / config.run_length)
    if runs < 1:
        raise InvalidParameter(
            f"--budget must hold a run of --run-length {config.run_length:g} s; it is "
            f"{config.budget}"
        )
    if not config.benches:
        raise InvalidParameter("--benches must name the benches that you have; it names none")
    if not config.force_limit > 0.0:
        raise InvalidParameter(f"--force-limit must be above 0; it is {config.force_limit:g}")
    quiet_warp()
    model = open_model(config.model, [load_mechanism(bench) for bench in config.benches])

    import numpy as np

    from tendon_newton.diagnosis.explanation import Setting
    from tendon_newton.diagnosis.next_experiment.first_plan import plan_first
    from tendon_newton.diagnosis.next_experiment.run_files import write_command, write_setting
    from tendon_newton.diagnosis.next_experiment.task_file import read_task

    settings = [Setting(bench=bench) for bench in config.benches]
    try:
        plan = plan_first(
            model,
            settings,
            runs=runs,
            duration=config.run_length,
            force_limit=config.force_limit,
            rng=np.random.default_rng(config.seed),
            task=None if config.task is None else read_task(config.task, settings[0]),
            progress=lambda text: print(f"  {text} ...", flush=True),
        )
    except InvalidModelFile as error:
        raise InvalidModelFile(f"{config.model}: {error}") from error
    out = make_folder(config.out)
    for number, step in enumerate(plan.steps, start=1):
        write_command(out / f"run_{number}.csv", step.plan)
        write_setting(out / f"run_{number}.toml", step)
    print(table(plan))
    print(f"\n  commands  {out}" if plan.steps else "\n  no command was written")


def table(plan: FirstPlan) -> str:
    """Return the runs and what they tell as tables for a terminal."""
    rows = ["", f"  {'run':6s} {'bench':16s} {'command':14s} {'bits':>6s}  most of them on"]
    for number, step in enumerate(plan.steps, start=1):
        how = step.plan
        most = max(step.told.numbers, key=lambda name: step.told.numbers[name])
        named = f"{how.place:16s} {how.excitation:14s}"
        rows.append(f"  {number:<6d} {named} {step.told.worth:6.1f}  {most}")
    rows += ["", f"  {'number':44s} expected interval, as a share of its range"]
    rows += [f"  {name:44s} {2.0**-bits:8.2g}" for name, bits in plan.bits.items()]
    if plan.ended:
        rows += ["", f"  {plan.ended}"]
    if plan.untold:
        rows += ["", f"  not told by any run on these benches: {', '.join(plan.untold)}"]
    return "\n".join(rows)
