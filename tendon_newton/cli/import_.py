"""Turn foreign logs into a dataset, with a report of what is wrong with them.

A LeRobotDataset, of which each joint becomes a dataset of its own; `diagnose` takes it as it is:
  tendon-newton import lerobot SOURCE --out arm --test episode=3

Anybody's CSV, JSON and ROS 2 bags, with a file that says what is what:
  tendon-newton import mapped SOURCE --mapping mapping.toml --out dataset --test part1=3

The lab of a clone also reads pendulum logs of Rhoban/bam, and their parameter file as a model:
  tendon-newton import bam SOURCE --out dataset --test kp=16
  tendon-newton import bam m6.json --out bam_m6
  tendon-newton diagnose dataset --model bam_m6/model.toml --out diagnosis
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import InvalidParameter, InvalidPlugIn

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tendon_newton.data.importers.writing import ImportReport

SHOWN_EVIDENCE = 4  # Recordings of a kind of finding whose evidence is printed; import.txt has all.


@dataclass(frozen=True, kw_only=True)
class ImportConfig:
    """Folders of the logs and of the dataset, and the held-out logs."""

    format: tyro.conf.Positional[str]
    """Format of the logs: lerobot, mapped for any CSV, JSON or ROS 2 bag with --mapping, or one of
    an installed plug-in: the lab of a clone has bam, xl330 and so101."""
    source: tyro.conf.Positional[Path]
    """Folder of the logs; for bam also a parameter file, which becomes a model.toml."""
    out: Path  # Folder for the dataset; new, or one that an earlier import wrote.
    test: tuple[str, ...] = ()
    """Logs of the test split, as conditions that must all hold: kp=200 trajectory=sin_sin; one log
    by default."""
    train: tuple[str, ...] = ()
    """Logs of the train split, likewise (kp=100,800 gives two values); all others by default."""
    mapping: Path | None = None
    """For mapped: the file that says which of their columns or topics, in which unit, is which of
    ours (docs/recordings_mapping.md)."""
    unit: str | None = None
    """For lerobot: what the joints are in, rad, deg or percent; seen where they are radians."""
    calibration: Path | None = None
    """For lerobot: the arm's calibration file, which says what 100 percent are."""
    mend: bool = False
    """Leave out rows that were not read, and give wrapped and unsigned registers their values back:
    what the findings say that --mend does."""


def main(config: ImportConfig) -> None:
    """Import, write and report."""
    from tendon_newton.data.importers import MAPPED, find_importer
    from tendon_newton.data.importers.imported import Imported

    reader = None if config.format == MAPPED else find_importer(config.format)
    refuse_foreign_options(config)
    imported = read(config, reader)
    if not isinstance(imported, Imported):
        raise InvalidPlugIn(
            f"{config.format} must give an Imported; it gave a {type(imported).__name__}"
        )
    from tendon_newton.workflows.importing import admit, mend, write_parts

    imported = admit(mend(imported) if config.mend else imported)
    show(write_parts(imported, config.out, config.test, config.train))


def refuse_foreign_options(config: ImportConfig) -> None:
    """Refuse options that belong to another format."""
    from tendon_newton.data.importers import MAPPED

    if config.format == MAPPED and config.mapping is None:
        raise InvalidParameter(
            "mapped needs --mapping FILE.toml; none is given. It says what each column is: "
            'bench = "spring_weak", files = "*.csv", [columns] t = {column = "time", unit = "s"}, '
            "theta_d, theta and perhaps force likewise, [model] kind and its numbers"
        )
    belonging = {"mapping": MAPPED, **dict.fromkeys(("unit", "calibration"), "lerobot")}
    for option, own in belonging.items():
        if getattr(config, option) is not None and config.format != own:
            raise InvalidParameter(
                f"--{option} belongs to the format {own}; the format is {config.format!r}"
            )


def read(config: ImportConfig, reader: Callable[[Path], object] | None) -> object:
    """Read the logs, or a parameter file; without a reader by the mapping."""
    from tendon_newton.data.importers.lerobot import LeRobotUnits, read_lerobot
    from tendon_newton.data.importers.mapped import read_mapped

    if config.mapping is not None:
        from tendon_newton.workflows.importing import refuse_model, spool_radius

        quiet_warp()
        imported = read_mapped(config.source, config.mapping, spool_radius, mend=config.mend)
        if imported.model.actuator.values or imported.model.fit:
            refuse_model(imported.model)
        return imported
    if config.format == "lerobot":
        units = LeRobotUnits(unit=config.unit, calibration=config.calibration)
        return read_lerobot(config.source, units)
    assert reader is not None  # refused without its mapping
    return reader(config.source)


def show(reports: Mapping[Path, ImportReport]) -> None:
    """Say what each dataset holds, what was found in any of them, and what to type next."""
    from tendon_newton.data.checks.finding import findings_text

    for out, report in reports.items():
        print(f"{out}: " + "\n".join(report.split_lines))
    found = dict.fromkeys(finding for report in reports.values() for finding in report.findings)
    print("\n".join(findings_text(found, SHOWN_EVIDENCE)))
    wrong = any(finding.severity == "defect" for finding in found)
    print("\nmend the defects, then:" if wrong else "\nnext:")
    first, *others = reports
    print(f"  {reports[first].next_command(first.parent if others else first)}")
    if others:
        print("  with --arm ASSET each servo is under the weight of its arm (docs/lerobot.md)")
