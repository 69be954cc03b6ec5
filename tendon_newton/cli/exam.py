"""Diagnose a folder of datasets with known causes and say how often the answer is right."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.diagnosis.exam_score import Mark


@dataclass(frozen=True, kw_only=True)
class ExamConfig:
    """Diagnose a folder of datasets with known causes and say how often the answer is right.

    The folder holds NAME/dataset.toml, NAME/model.toml and truth/NAME.json. Answers go to
    OUT/NAME/diagnosis.json; a run that broke off goes on where it stopped.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """Datasets and their truths."""
    out: Path
    """Where the answers go."""
    workers: int = os.cpu_count() or 1
    """Processes."""
    only: tuple[str, ...] = ()
    """Names of datasets; all by default."""


def main(config: ExamConfig) -> None:
    """Take the exam and print the marks."""
    import json

    from tendon_newton.cli.output import make_folder
    from tendon_newton.diagnosis.exam import take_exam
    from tendon_newton.diagnosis.exam_score import confusion, rates

    out = make_folder(config.out)
    marks: list[Mark] = []
    for mark in take_exam(config.folder, out, workers=config.workers, only=config.only):
        marks.append(mark)
        print(f"{len(marks):4d}  {line(mark)}", flush=True)
    print(table(marks))
    record = {
        "rates": {name: {"rate": rate, "cases": n} for name, (rate, n) in rates(marks).items()},
        "confusion": confusion(marks),
    }
    (out / "exam.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"\nwrote {out / 'exam.json'}")


def line(mark: Mark) -> str:
    """Return one dataset's result."""
    truth = mark.truth
    said = "+".join("/".join(names) for names in mark.classes) or "-"
    flag = "  " if mark.right else "X "
    return (
        f"{flag}{truth.id:8s} {truth.family:8s} {mark.verdict:17s} "
        f"{truth.causes} -> {said}  ({mark.wall_time_s:.0f} s)"
    )


def table(marks: Sequence[Mark]) -> str:
    """Return the rates as a table."""
    from tendon_newton.diagnosis.exam_score import rates

    rows = [f"  {name:46s} {rate:7.3f}   of {n}" for name, (rate, n) in rates(marks).items()]
    walls = sorted(m.wall_time_s for m in marks)
    if walls:
        name = "seconds per dataset, median and longest"
        rows.append(f"  {name:46s} {walls[len(walls) // 2]:7.1f}   {walls[-1]:.1f}")
    return "\n".join(["", *rows])
