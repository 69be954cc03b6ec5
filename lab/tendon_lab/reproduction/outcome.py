"""Result of a stage of a reproduction: rows for the table, and numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Row:
    """One number of the paper and ours beside it."""

    experiment: str  # Name of the experiment
    measure: str  # Measured quantity, and the model
    unit: str
    paper: float | None  # The paper's value; None where it has none
    ours: float  # Median over benches or seeds
    low: float  # Least of them
    high: float  # Greatest of them
    count: int  # Number of benches, seeds or experiments
    over: str  # Kind of the spread: over benches, seeds or experiments
    differs: str = ""  # Differences from the paper, besides the bench


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """All that a stage found."""

    rows: tuple[Row, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    """Further numbers of the JSON file, in SI units unless a key says otherwise."""
    text: str = ""  # Tables and sentences in Markdown


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


def reductions(
    errors: Mapping[str, Sequence[float]], ideals: Sequence[str]
) -> dict[str, list[float]]:
    """Return by how much each error is below that of the better ideal source, by bench [%]."""
    known = [errors[name] for name in ideals if name in errors]
    if not known:
        return {}
    better = np.min(known, axis=0)
    return {
        name: (100.0 * (1.0 - np.asarray(found) / better)).tolist()
        for name, found in errors.items()
        if name not in ideals
    }
