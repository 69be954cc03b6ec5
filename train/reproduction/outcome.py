"""What a stage of a reproduction found: rows for the table, numbers, figures."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.json_file import read_json
from tendon_newton.errors import InvalidOutput


@dataclass(frozen=True, kw_only=True)
class Row:
    """One number of the paper and ours beside it."""

    experiment: str
    """What was done."""
    measure: str
    """What was measured, on which model."""
    unit: str
    paper: float | None
    """The paper's value; None where it has none."""
    ours: float
    """Median over benches or seeds."""
    low: float
    """Least of them."""
    high: float
    """Greatest of them."""
    count: int
    """How many."""
    over: str
    """What they differ in: benches, seeds or experiments."""
    differs: str = ""
    """What is not as in the paper, besides the bench."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture and what stands below it."""

    file: str
    """Name inside the folder of figures."""
    caption: str


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """All that a stage found."""

    rows: tuple[Row, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    """What else goes into the JSON file, in SI units unless a key says otherwise."""
    figures: tuple[Figure, ...] = ()
    text: str = ""
    """Tables and sentences in Markdown."""


def row(
    experiment: str,
    measure: str,
    unit: str,
    values: Sequence[float],
    *,
    paper: float | None = None,
    over: str = "benches",
    differs: str = "",
) -> Row:
    """Return the row of some values: median, least and greatest."""
    found = np.asarray(values, dtype=np.float64)
    return Row(
        experiment=experiment,
        measure=measure,
        unit=unit,
        paper=paper,
        ours=float(np.median(found)),
        low=float(found.min()),
        high=float(found.max()),
        count=found.size,
        over=over,
        differs=differs,
    )


def mean_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Return mean and 95 % interval of it, by Student's t over the values."""
    from scipy.stats import t

    found = np.asarray(values, dtype=np.float64)
    mean = float(found.mean())
    if found.size < 2:
        return mean, math.nan, math.nan
    half = float(t.ppf(0.975, found.size - 1) * found.std(ddof=1) / math.sqrt(found.size))
    return mean, mean - half, mean + half


def write_outcome(path: Path, outcome: Outcome, key: str) -> None:
    """Write an outcome with the key of what it was made from, whole or not at all.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    table = {"key": key, **asdict(outcome)}
    beside = path.with_name(f".{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
        beside.replace(path)
    except OSError as error:
        raise InvalidOutput(f"{path}: {error.strerror or error}") from error


def read_outcome(path: Path, key: str) -> Outcome | None:
    """Return an outcome that was made from the same, None where there is none."""
    if not path.is_file():
        return None
    table = read_json(path, InvalidOutput, "a stage's outcome is a JSON file")
    if table.get("key") != key:
        return None
    return Outcome(
        rows=tuple(Row(**each) for each in table["rows"]),
        numbers=table["numbers"],
        figures=tuple(Figure(**each) for each in table["figures"]),
        text=table["text"],
    )
