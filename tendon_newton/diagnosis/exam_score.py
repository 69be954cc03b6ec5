"""How often the diagnosis is right: answers against truths."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tendon_newton.errors import InvalidDataset

Family = Literal["single", "pair", "clean", "outside"]
LARGEST_CLASS = 3
"""Names in an answer's class, the named one included; a larger class is no answer."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is hidden in one dataset of an exam."""

    id: str
    family: Family
    effects: Mapping[str, Mapping[str, float]]
    """True effects with their parameters."""
    outside: tuple[str, ...]
    """Causes that no effect of the catalogue describes."""
    near: tuple[str, ...]
    """Effects that imitate them so well that naming them is no mistake."""
    strength: float
    """Change of the held-out force, in noise floors."""
    weak: bool
    """Whether the cause is too weak to be expected."""

    @property
    def causes(self) -> str:
        """All true causes in one word."""
        return "+".join([*self.effects, *self.outside]) or "nothing"


@dataclass(frozen=True, kw_only=True)
class Mark:
    """One answer, judged."""

    truth: Truth
    said: tuple[str, ...]
    """Effects named, strongest first."""
    classes: tuple[tuple[str, ...], ...]
    """For each the names that it stands for."""
    verdict: str
    """Verdict of the diagnosis, or why there is none."""
    wall_time_s: float
    parameter_errors: tuple[float, ...]
    """Relative errors of the parameters of exactly named effects."""
    covered: tuple[bool, ...]
    """Whether their intervals hold the truth."""

    @property
    def exact(self) -> bool:
        """Whether the strongest named effect is a true one."""
        return bool(self.said) and self.said[0] in self.truth.effects

    @property
    def in_class(self) -> bool:
        """Whether the strongest named effect, or one not told apart from it, is a true one."""
        return bool(self.said) and any(name in self.truth.effects for name in self.classes[0])

    @property
    def found(self) -> int:
        """How many true effects were named, exactly or by class, each answer used once."""
        exact = [name for name in self.truth.effects if name in self.said]
        left = [c for name, c in zip(self.said, self.classes, strict=True) if name not in exact]
        count = len(exact)
        for name in self.truth.effects:
            place = next((i for i, c in enumerate(left) if name in c), None)
            if name not in exact and place is not None:
                left.pop(place)
                count += 1
        return count

    @property
    def right(self) -> bool:
        """Whether the answer as a whole is what an examiner wants."""
        if self.truth.family == "clean":
            return not self.said and self.verdict == "no_gap"
        if self.truth.family == "outside":
            near = set(self.said) <= set(self.truth.near)
            return near and self.verdict == ("partly_explained" if self.said else "unexplained")
        if self.truth.family == "pair":
            return self.found == len(self.truth.effects)
        return self.in_class


def read_truth(path: Path) -> Truth:
    """Read the truth of one dataset.

    Raises:
        InvalidDataset: The file is no truth.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        outside = table.get("outside", [])
        return Truth(
            id=str(table["id"]),
            family=table["family"],
            effects={e["name"]: dict(e["parameters"]) for e in table["effects"]},
            outside=tuple(o["name"] for o in outside),
            near=tuple(n for o in outside for n in o.get("near", ())),
            strength=float(table.get("strength", {}).get("ratio", 0.0)),
            weak=bool(table.get("weak", False)),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InvalidDataset(
            f"{path}: a truth needs id, family, effects with name and parameters; {error!r}"
        ) from error


def judge(truth: Truth, answer: Mapping[str, Any] | None) -> Mark:
    """Judge one answer (the contents of a diagnosis.json); None counts as wrong."""
    effects = list(answer["effects"]) if answer else []
    errors, covered = [], []
    for effect in effects:
        for key, value in truth.effects.get(effect["name"], {}).items():
            estimate = effect["parameters"].get(key)
            if estimate is None:
                errors.append(math.inf)
                continue
            size = abs(value - 1.0) if key == "scale" else abs(value)
            errors.append(abs(estimate["value"] - value) / max(size, 1.0e-12))
            low, high = estimate["ci95"]
            covered.append(low <= value <= high)
    classes = [(e["name"], *e["indistinguishable_from"]) for e in effects]
    return Mark(
        truth=truth,
        said=tuple(e["name"] for e in effects),
        classes=tuple(c if len(c) <= LARGEST_CLASS else c[:1] for c in classes),
        verdict=answer["verdict"] if answer else "no answer",
        wall_time_s=float(answer["wall_time_s"]) if answer else 0.0,
        parameter_errors=tuple(errors),
        covered=tuple(covered),
    )


def rates(marks: Sequence[Mark]) -> dict[str, tuple[float, int]]:
    """Return each rate with the number of cases it is over; rates over nothing are left out."""
    single = [m for m in marks if m.truth.family == "single" and not m.truth.weak]
    pairs = [m for m in marks if m.truth.family == "pair"]
    clean = [m for m in marks if m.truth.family == "clean"]
    outside = [m for m in marks if m.truth.family == "outside"]
    known = [*single, *pairs]
    covered = [c for m in known for c in m.covered]
    errors = sorted(e for m in known for e in m.parameter_errors)
    table: dict[str, tuple[float, int]] = {}

    def add(name: str, cases: Sequence[Any], test: Callable[[Any], bool]) -> None:
        if cases:
            table[name] = (sum(map(test, cases)) / len(cases), len(cases))

    add("single: true cause named first", single, lambda m: m.exact)
    add("single: true cause first or in its class", single, lambda m: m.in_class)
    add("single: confidently wrong", single, confidently_wrong)
    add("single: something else named too", single, lambda m: len(m.said) > m.found)
    add("clean: a cause named", clean, lambda m: bool(m.said))
    add("clean: verdict no_gap", clean, lambda m: m.verdict == "no_gap")
    add("outside: no wrong name", outside, lambda m: m.right)
    add("pair: both found", pairs, lambda m: m.found == 2)
    add("pair: nothing else named", pairs, lambda m: len(m.said) == m.found)
    add("intervals that hold the truth", covered, bool)
    if errors:
        table["median relative error of a parameter"] = (errors[len(errors) // 2], len(errors))
    return table


def confidently_wrong(mark: Mark) -> bool:
    """Tell whether one cause was named, without a class, and wrongly."""
    return bool(mark.said) and not mark.in_class and len(mark.classes[0]) == 1


def confusion(marks: Iterable[Mark]) -> dict[str, dict[str, int]]:
    """Return true cause -> first name given -> count."""
    table: dict[str, dict[str, int]] = {}
    for mark in marks:
        said = mark.said[0] if mark.said else mark.verdict
        row = table.setdefault(mark.truth.causes, {})
        row[said] = row.get(said, 0) + 1
    return table
