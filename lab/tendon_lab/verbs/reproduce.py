"""Reproduce the paper's results, each beside the paper's number, on the virtual bench.

  tendon-newton reproduce --quick --out reproduction

records the paper's 36 minutes, trains force networks, diagnoses the physical model, and runs the
paper's experiments: forces on three setups and in contact, the tip on a
sinusoid. OUT gets reproduction.md with the paper's value beside ours in every row,
reproduction.json with every number, seed, commit and hash, and every model as a file for other
verbs. What is finished is not done again; the same seed gives the same numbers.

The stages, with --only: recordings, diagnosis, networks, force, tip.
Without --quick it takes hours on a few cores: ten benches, longer trainings. The paper's policies
are a study of their own: python -m lab.studies.diagnosed_policies.
With --jobs N, N processes do the jobs of a stage side by side.

On real recordings, one folder for each bench, with the test recordings named as here:
  tendon-newton reproduce --recordings bench_a bench_b --out reproduction
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from tendon_newton.cli.terminal import Terminal
from tendon_newton.scheduler import JobOptions, open_executor

if TYPE_CHECKING:
    from tendon_lab.reproduction.settings import ReproductionSettings


@dataclass(frozen=True, kw_only=True)
class ReproduceConfig:
    """What to reproduce, and where it goes."""

    out: Path  # Folder for everything; made if it is not there.
    quick: bool = False
    """Fewer benches and short trainings: minutes instead of hours."""
    only: tuple[str, ...] = ()
    """Stages to run, with those that they need; all of them unless given."""
    seed: int = 0  # Seed of what the recordings draw and of the networks' starting weights.
    units: tuple[int, ...] = ()
    """Units of the virtual bench; 0 to 4 if quick, else 0 to 9, unless given."""
    recordings: tuple[Path, ...] = ()
    """Folders of real recordings, in place of the virtual benches."""
    causes: Path | None = None
    """Model file whose causes are fitted to every bench; a diagnosis finds them unless given."""
    jobs: tyro.conf.OmitArgPrefixes[JobOptions] = field(default_factory=JobOptions)
    """Where the jobs of each stage are done."""


def main(config: ReproduceConfig) -> None:
    """Run the stages and write the report."""
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_lab.reproduction.reproduction import Reproduction
    from tendon_lab.reproduction.reproduction_report import rows_table, write_report
    from tendon_lab.reproduction.steps.stage_list import run_stages
    from tendon_lab.reproduction.virtual_benches import VirtualBenches

    with open_executor(config.jobs) as executor:
        reproduction = Reproduction(
            settings=settings_of(config),
            out=make_folder(config.out),
            bench=None if config.recordings else VirtualBenches(operator=Terminal()),
            folders=config.recordings,
            causes=config.causes,
            tell=say,
            executor=executor,
        )
        outcomes = run_stages(reproduction, config.only)
    table, page = write_report(reproduction, outcomes)
    print(rows_table([row for outcome in outcomes.values() for row in outcome.rows]))
    print(f"\nwrote {page} and {table.name}")


def settings_of(config: ReproduceConfig) -> ReproductionSettings:
    """Return the settings that the options name."""
    from tendon_lab.reproduction.settings import find_settings

    settings = find_settings("quick" if config.quick else "full")
    return replace(settings, seed=config.seed, units=config.units or settings.units)


def say(text: str) -> None:
    """Print a line about what is being done."""
    print(text, flush=True)
