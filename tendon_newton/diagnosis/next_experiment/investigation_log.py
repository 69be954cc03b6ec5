"""The log of an investigation: what was open at each step, what was tried, why, what it brought."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.values import is_table
from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.diagnosis.explanation import Estimate
from tendon_newton.errors import InvalidOutput, shown

SCHEMA = 1
PROMISE = "the log of an investigation is a JSON file"


@dataclass(frozen=True, kw_only=True)
class Step:
    """One run, and what the diagnosis with it says."""

    name: str
    bench: str
    seconds: float
    """Length [s]."""
    why: str
    """What it was chosen for."""
    split: str = "train"
    excitation: str = "random_steps"
    """Shape of the command, of the library where no command is designed."""
    command: tuple[float, ...] | None = None
    """Designed command at the rows of the recording [rad]."""
    expected: Mapping[str, float] | None = None
    """Information expected about each number, as ``owner.name`` [bit]."""
    verdict: str | None = None
    """Verdict of the diagnosis with this run; None before it."""
    causes: Mapping[str, Mapping[str, tuple[float, float, float]]] | None = None
    """Named cause -> number -> value and ends of the 95 % interval."""
    open: tuple[tuple[str, ...], ...] = ()
    """Classes: causes that are not told apart, the named one first."""
    brought: Mapping[str, float] | None = None
    """Information that came about each number that the diagnosis before had too [bit]."""
    settled: tuple[tuple[str, ...], ...] = ()
    """Classes of the diagnosis before that are not open any more."""

    @property
    def bits(self) -> tuple[float, float] | None:
        """Information expected and brought, about the numbers that have both [bit]."""
        if self.expected is None or self.brought is None:
            return None
        both = self.expected.keys() & self.brought.keys()
        return sum(self.expected[k] for k in both), sum(self.brought[k] for k in both)

    def taught_nothing(self, little: float) -> bool:
        """Tell whether a run neither settled a class nor narrowed the intervals by some bits.

        Where all intervals are as wide as their ranges, nothing can be told of what came.
        """
        brought = self.brought or {}
        return bool(brought) and not self.settled and sum(brought.values()) < little

    def text(self) -> str:
        """Return what is known after it, in a line."""
        names = ", ".join(self.causes or {}) or "no cause"
        classes = "; ".join(" or ".join(names) for names in self.open)
        words = f"{self.name}: {self.verdict}, {names}" + (f"; open: {classes}" if classes else "")
        if self.bits is None:
            return words
        expected, came = self.bits
        return f"{words}; {came:.1f} bits came, {expected:.1f} were expected"


@dataclass(frozen=True, kw_only=True)
class InvestigationLog:
    """All steps so far."""

    options: Mapping[str, Any]
    """What all runs share, by the names of the command line."""
    steps: tuple[Step, ...] = ()
    ended: str | None = None
    """Why nothing more is recorded; None while something is."""

    @property
    def runs(self) -> int:
        """Number of training runs."""
        return sum(step.split == "train" for step in self.steps)

    @property
    def seconds(self) -> float:
        """Time recorded [s]."""
        return sum(step.seconds for step in self.steps)


def with_answer(step: Step, answer: Path, earlier: Path | None, *, actuator: str) -> Step:
    """Return a step with what the diagnosis with it says, beside that of the one before.

    Args:
        step: The last run.
        answer: ``diagnosis.json`` with it.
        earlier: That of the run before, if there was one.
        actuator: Kind of the actuator, which owns the numbers that are refitted.
    """
    now = read_diagnosis(answer)
    classes = classes_of(now)
    step = replace(
        step,
        verdict=now.verdict,
        causes={
            cause.name: {
                name: (number.value, *number.ci95) for name, number in cause.parameters.items()
            }
            for cause in now.effects
        },
        open=classes,
    )
    if earlier is None:
        return step
    before = read_diagnosis(earlier)
    left = {frozenset(names) for names in classes}
    gone = tuple(names for names in classes_of(before) if frozenset(names) not in left)
    return replace(step, brought=bits_between(before, now, actuator), settled=gone)


def classes_of(diagnosis: StatedDiagnosis) -> tuple[tuple[str, ...], ...]:
    """Return the causes that a diagnosis could not tell apart."""
    return tuple(
        (cause.name, *cause.indistinguishable_from)
        for cause in diagnosis.effects
        if cause.indistinguishable_from
    )


def bits_between(
    before: StatedDiagnosis, after: StatedDiagnosis, actuator: str
) -> dict[str, float]:
    """Return log2 of what the interval of each number that both have has shrunk by [bit].

    An interval that ends at its range both times does not say what came: it is left out.
    """
    old, new = (numbers_of(diagnosis, actuator) for diagnosis in (before, after))
    return {
        key: math.log2(width(old[key]) / width(new[key]))
        for key in sorted(old.keys() & new.keys())
        if min(width(old[key]), width(new[key])) > 0.0 and not (old[key].flat and new[key].flat)
    }


def numbers_of(diagnosis: StatedDiagnosis, actuator: str) -> dict[str, Estimate]:
    """Return each number of a diagnosis, as ``owner.name``."""
    owners = {actuator: diagnosis.fitted} | {c.name: c.parameters for c in diagnosis.effects}
    return {
        f"{owner}.{name}": number
        for owner, numbers in owners.items()
        for name, number in numbers.items()
    }


def width(number: Estimate) -> float:
    """Return the width of a number's interval."""
    return number.ci95[1] - number.ci95[0]


def write_log(path: Path, log: InvestigationLog) -> None:
    """Write the log whole or not at all."""
    write_json(path, {"schema": SCHEMA, **asdict(log)})


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
    causes, command = row["causes"], row["command"]
    return Step(
        **{
            **row,
            "command": None if command is None else tuple(command),
            "open": tuple(map(tuple, row["open"])),
            "settled": tuple(map(tuple, row["settled"])),
            "causes": None
            if causes is None
            else {c: {k: tuple(v) for k, v in own.items()} for c, own in causes.items()},
        }
    )
