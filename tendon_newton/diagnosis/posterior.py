"""What a diagnosis leaves open: whole sets of causes, their numbers together."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.special import ndtri

from tendon_newton.data.files.checked_table import CheckedTable, read_checked
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidDiagnosis

ENDING = ".posterior.json"  # Ending of the file beside a ``diagnosis.json``, in place of its own
SCHEMA = 1
SURE = float(ndtri(0.975))  # Standard deviations to either end of a 95 % interval [1]
QUARTERS = 4.0
"""A range holds so many standard deviations of a number of which nothing else is known [1]: as many
as a 95 % interval."""
RIGID = 0.01
"""Coordinate below which a drawn number that is infinite when absent is absent [1]: strings stiffer
than a hundred typical ones, 1 MN/m, do not stretch, and no step of a simulation follows them."""
Kind = Literal["linear", "log", "inverse"]


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """One number of a model as a fit sees it: null is zero, and typical is about one."""

    kind: Kind  # ``log`` for what is never zero, ``inverse`` for what is infinite when absent
    origin: float  # Value at zero [unit]; the unit of the inverse where that is infinite
    unit: float  # Change of the value, or of its logarithm, per one
    lower: float  # Least coordinate
    upper: float  # Greatest one

    def value(self, u: float) -> float:
        """Return the physical value at a coordinate."""
        if self.kind == "log":
            return self.origin * float(np.exp(self.unit * u))
        if self.kind == "inverse":
            return np.inf if u <= 0.0 else self.origin / u
        return self.origin + self.unit * u

    def place(self, value: float) -> float:
        """Return the coordinate of a physical value."""
        if self.kind == "log":
            return float(np.log(value / self.origin)) / self.unit
        if self.kind == "inverse":
            return 0.0 if np.isinf(value) else self.origin / value
        return (value - self.origin) / self.unit

    def is_nothing(self, u: float) -> bool:
        """Tell whether a number means nothing: it vanished, or limits as little as it can."""
        return u <= self.lower if self.kind == "inverse" else u == 0.0


@dataclass(frozen=True, kw_only=True)
class OpenNumber:
    """A number that a set of causes was fitted with."""

    owner: str  # Actuator, cause or bench
    name: str
    coordinate: Coordinate
    place: float  # Coordinate at the optimum


@dataclass(frozen=True, kw_only=True)
class FittedSet:
    """A set of causes at its optimum, and how far its numbers may be off, all together."""

    weight: float  # Share of the worlds that have it [1]
    causes: tuple[str, ...]
    numbers: tuple[OpenNumber, ...]
    """F numbers: those of the causes, and what is stated with a tolerance."""
    covariance: Array  # Covariance of the coordinates, given the causes, shape (F, F)

    def __post_init__(self) -> None:
        self.covariance.setflags(write=False)

    def at(self, normal: Array) -> Array:
        """Return the values of the numbers, within their ranges, shape (N, F).

        A number that is as open as its range is drawn with four standard deviations in it, and what
        the data tie to it goes with it.

        Args:
            normal: Standard normal numbers, shape (N, F).
        """
        own = [number.coordinate for number in self.numbers]
        width, sizes, ways = self._ways()
        places = np.array([n.place for n in self.numbers]) + (normal * sizes @ ways.T) * width
        places = np.clip(places, [c.lower for c in own], [c.upper for c in own])
        rigid = (places < RIGID) & np.array([c.kind == "inverse" for c in own], dtype=bool)
        places = np.where(rigid, 0.0, places)
        values = [[c.value(u) for c, u in zip(own, row, strict=True)] for row in places]
        return np.array(values).reshape(normal.shape)

    @property
    def within_ranges(self) -> Array:
        """Covariance of the coordinates as worlds are drawn, shape (F, F)."""
        width, sizes, ways = self._ways()
        return (ways * sizes**2) @ ways.T * np.outer(width, width)

    def _ways(self) -> tuple[Array, Array, Array]:
        """Return widths of the ranges, and standard deviations along directions in them."""
        own = [number.coordinate for number in self.numbers]
        width = np.array([max(c.upper - c.lower, 1.0e-12) for c in own]) / QUARTERS
        sizes, ways = np.linalg.eigh(self.covariance / np.outer(width, width))
        sizes = np.maximum(sizes, 0.0)
        return width, np.sqrt(sizes / (1.0 + sizes)), ways


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """The sets of causes that a diagnosis fitted, by their weight; none where it knows none."""

    sets: tuple[FittedSet, ...] = ()


def write_posterior(diagnosis: Path, posterior: Posterior) -> None:
    """Write what a diagnosis leaves open beside its ``diagnosis.json``, a set on each line."""
    rows = [
        json.dumps(
            {
                "weight": own.weight,
                "causes": own.causes,
                "numbers": [asdict(number) for number in own.numbers],
                "covariance": own.covariance.tolist(),
            }
        )
        for own in posterior.sets
    ]
    sets = ",\n  ".join(rows)
    path = diagnosis.with_suffix(ENDING)
    write_text(path, f'{{\n "schema": {SCHEMA},\n "sets": [\n  {sets}\n ]\n}}\n')


def read_posterior(diagnosis: Path) -> Posterior:
    """Read what a diagnosis leaves open, from the file beside its ``diagnosis.json``.

    Raises:
        InvalidDiagnosis: There is none, or it is broken.
    """
    path = diagnosis.with_suffix(ENDING)
    if not path.is_file():
        raise InvalidDiagnosis(
            f"{path}: worlds are drawn from what a diagnosis leaves open, and this one has no such "
            "file: diagnose the data again with this release"
        )
    table = read_checked(path, InvalidDiagnosis, "what a diagnosis leaves open is a JSON file")
    if table.values.get("schema") != SCHEMA:
        table.refuse("schema", f"{SCHEMA}, the one that this release reads")
    return Posterior(sets=tuple(map(read_set, table.tables("sets"))))


def read_set(table: CheckedTable) -> FittedSet:
    """Check one set of causes."""
    numbers = table.value("numbers", tuple[OpenNumber, ...])
    if table.number("weight") <= 0.0:
        table.refuse("weight", "> 0")
    try:
        covariance = np.array(table.values.get("covariance"), dtype=float)
        covariance = covariance if covariance.size else covariance.reshape(0, 0)
    except (TypeError, ValueError):
        covariance = np.zeros(0)
    if covariance.shape != (len(numbers),) * 2 or not np.isfinite(covariance).all():
        table.refuse("covariance", f"a table of {len(numbers)} x {len(numbers)} numbers")
    return table.record(FittedSet, numbers=numbers, covariance=covariance)
