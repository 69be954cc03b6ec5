"""Diagnose a folder of datasets with known causes and say how often the answer is right."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.scheduler import JobOptions, core_count

if TYPE_CHECKING:
    from tendon_lab.exam.exam_rates import Rate
    from tendon_lab.exam.exam_score import Mark


@dataclass(frozen=True, kw_only=True)
class ExamConfig:
    """Diagnose a folder of datasets with known causes and say how often the answer is right.

    The folder holds NAME/dataset.toml, NAME/model.toml and truth/NAME.json. Answers go to
    OUT/NAME/diagnosis.json, the rates to OUT/exam.json. A run that broke off goes on where it
    stopped.
    """

    folder: Annotated[Path, tyro.conf.Positional]  # Datasets and their truths.
    out: Path  # Where the answers go.
    only: tuple[str, ...] = ()  # Names of datasets; all by default.
    jobs: tyro.conf.OmitArgPrefixes[JobOptions] = field(
        default_factory=lambda: JobOptions(jobs=core_count())
    )
    """Where diagnoses are done."""


def main(config: ExamConfig) -> None:
    """Take the exam, and print and write the marks."""
    from tendon_lab.exam.exam_rates import rates
    from tendon_lab.exam.run_exam import read_truths, take_exam
    from tendon_newton.data.files.json_file import write_json
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.diagnosis.time_left import time_text

    out = make_folder(config.out)
    total = len(config.only or read_truths(config.folder))
    marks: list[Mark] = []
    start, fresh = time.monotonic(), 0
    for mark in take_exam(config.folder, out, options=config.jobs, only=config.only):
        marks.append(mark)
        fresh += not mark.earlier
        left = (time.monotonic() - start) / max(1, fresh) * (total - len(marks))
        end = f"  {time_text(left)} left" if fresh and len(marks) < total else ""
        print(f"{len(marks):4d}/{total}  {line(mark)}{end}", flush=True)
    found = rates(marks)
    print("\n".join(["", *map(row, found), ""]))
    told = {
        r.name: {"rate": r.value, "cases": r.cases, "fixed": r.fixed, "random": r.random}
        for r in found
    }
    write_json(out / "exam.json", {"rates": told})
    print(f"  {out / 'exam.json'}")


def line(mark: Mark) -> str:
    """Return one dataset's result."""
    truth = mark.truth
    said = "+".join("/".join(names) for names in mark.classes) or "-"
    flag = "  " if mark.right else "X "
    return (
        f"{flag}{truth.id:8s} {truth.family:8s} {mark.verdict:17s} "
        f"{truth.causes} -> {said}  ({mark.wall_time_s:.0f} s)"
    )


def row(rate: Rate) -> str:
    """Return one figure."""
    constant = "" if rate.fixed is None else f"  fixed {rate.fixed:.3f}, random {rate.random:.3f}"
    return f"  {rate.name:46s} {rate.value:9.3f}   of {rate.cases:<5d}{constant}"
