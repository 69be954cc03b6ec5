"""The log of an investigation: what was open at each step, what was tried, why, what it brought."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.values import is_table
from tendon_newton.diagnosis.posterior import SURE, FittedSet, Posterior
from tendon_newton.errors import InvalidOutput, shown

SCHEMA = 2
PROMISE = "the log of an investigation is a JSON file"


@dataclass(frozen=True, kw_only=True)
class Step:
    """One run, and what the diagnosis with it says."""

    name: str
    bench: str
    seconds: float  # Length [s]
    why: str  # What it was chosen for
    split: str = "train"
    excitation: str = "random_steps"
    """Shape of the command, of the library where no command is designed."""
    command: tuple[float, ...] | None = None  # Designed command at the rows of the recording [rad]
    expected: Mapping[str, float] | None = None
    """Information expected about ``names`` and about the ``task`` [bit]."""
    verdict: str | None = None
    """Verdict of a diagnosis with this run; None where sets were only carried on."""
    probabilities: Mapping[str, float] | None = None
    """Weight of all sets that hold a cause [1], the likeliest first; None before an answer."""
    causes: Mapping[str, Mapping[str, tuple[float, float, float]]] = field(default_factory=dict)
    """Cause of the likeliest set -> number -> value and ends of the 95 % interval."""
    left: Mapping[str, float] | None = None
    """What is left open with this run: entropy of the ``names`` [bit], and spread of predictions
    of the ``task`` [errors of form]; None where no set is known."""
    by_hand: str = ""  # Measurement by hand that tells more for its time than a run does, in words

    def brought(self, before: Step) -> dict[str, float] | None:
        """Return information that came with this run [bit], as `expected` has it."""
        if self.left is None or before.left is None:
            return None
        return {
            "names": before.left["names"] - self.left["names"],
            "task": math.log2(before.left["task"] / self.left["task"]),
        }

    def text(self) -> str:
        """Return what is known after it, in a line."""
        shown = [f"{name} {share:.0%}" for name, share in (self.probabilities or {}).items()]
        words = f"{self.name}: {self.verdict or 'carried on'}, {', '.join(shown) or 'no cause'}"
        return f"{words}; {self.by_hand}" if self.by_hand else words


@dataclass(frozen=True, kw_only=True)
class InvestigationLog:
    """All steps so far."""

    options: Mapping[str, Any]  # What all runs share, by the names of the command line
    steps: tuple[Step, ...] = ()
    ended: str | None = None  # Why nothing more is recorded; None while something is

    @property
    def runs(self) -> int:
        """Number of training runs."""
        return sum(step.split == "train" for step in self.steps)

    @property
    def seconds(self) -> float:
        """Time recorded [s]."""
        return sum(step.seconds for step in self.steps)


def with_answer(step: Step, posterior: Posterior, verdict: str | None) -> Step:
    """Return a step with what is known once its run is.

    Args:
        step: The last run.
        posterior: Sets of causes that are left.
        verdict: Verdict of a diagnosis; None where sets were only carried on.
    """
    weights: dict[str, float] = {}
    for own in posterior.sets:
        for cause in own.causes:
            weights[cause] = weights.get(cause, 0.0) + own.weight
    total = sum(own.weight for own in posterior.sets)
    return replace(
        step,
        verdict=verdict,
        probabilities={
            cause: weight / total
            for cause, weight in sorted(weights.items(), key=lambda item: -item[1])
        },
        causes=intervals(posterior.sets[0]) if posterior.sets else {},
    )


def intervals(own: FittedSet) -> dict[str, dict[str, tuple[float, float, float]]]:
    """Return the numbers of each cause of a set with the ends of their 95 % intervals."""
    found: dict[str, dict[str, tuple[float, float, float]]] = {cause: {} for cause in own.causes}
    for number, spread in zip(own.numbers, np.sqrt(own.within_ranges.diagonal()), strict=True):
        if number.owner in found:
            scale = number.coordinate
            places = number.place + SURE * spread * np.array([0.0, -1.0, 1.0])
            value, *ends = (
                scale.value(float(u)) for u in np.clip(places, scale.lower, scale.upper)
            )
            found[number.owner][number.name] = (value, min(ends), max(ends))
    return found


def write_log(path: Path, log: InvestigationLog) -> None:
    """Write the log whole or not at all; JSON has no infinity, which stands there as null."""
    rows = [asdict(step) for step in log.steps]
    for row in rows:
        for own in row["causes"].values():
            own |= {k: [u if math.isfinite(u) else None for u in v] for k, v in own.items()}
    write_json(path, {"schema": SCHEMA, **asdict(log), "steps": rows})


def read_log(path: Path, options: Mapping[str, Any]) -> InvestigationLog:
    """Read the log of an investigation that was begun, or begin one.

    Args:
        path: The log.
        options: What all runs share, by the names of the command line.

    Raises:
        InvalidOutput: The file is no log, or its investigation was begun with other options.
    """
    if not path.exists():
        return InvestigationLog(options=options)
    table = read_json(path, InvalidOutput, PROMISE)
    if table.get("schema") != SCHEMA or not is_table(table.get("options")):
        raise InvalidOutput(
            f"{path}: {PROMISE} of schema {SCHEMA} with the options that it was begun with; it has "
            f"schema {shown(table.get('schema'))}: give another folder"
        )
    refuse_other_options(path, table["options"], options)
    try:
        steps = tuple(read_step(row) for row in table["steps"])
        return InvestigationLog(options=options, steps=steps, ended=table["ended"])
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidOutput(f"{path}: a step of the log is broken: {error!r}") from error


def refuse_other_options(path: Path, begun: Mapping[str, Any], options: Mapping[str, Any]) -> None:
    """Refuse to go on with other options than those of the beginning, and say which differ."""
    other = [key for key, value in options.items() if begun.get(key) != value]
    if other:
        before, now = (
            ", ".join(f"--{key} {option_text(table.get(key))}" for key in other)
            for table in (begun, options)
        )
        raise InvalidOutput(
            f"{path}: this investigation was begun with {before}; asked for is {now}: go on with "
            "the same options or give another folder"
        )


def option_text(value: Any) -> str:
    """Return an option's value as a message names it."""
    if value is None:
        return "not given"
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def read_step(row: Mapping[str, Any]) -> Step:
    """Read one step."""
    command = row["command"]
    causes = {
        c: {k: tuple(math.inf if u is None else u for u in v) for k, v in own.items()}
        for c, own in row["causes"].items()
    }
    command = None if command is None else tuple(command)
    return Step(**{**row, "command": command, "causes": causes})
