"""Strict score of a diagnosis of a bench with some twenty faults at once.

A name is deserved if three things hold. It, or one of two at most that it is not told apart from,
is in the plant of some bench. The intervals of its sizes do not all hold the value that means
nothing. Each number that the plant states for it lies inside its interval on some bench.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from tendon_lab.exam.constant_answers import reached
from tendon_lab.exam.exam_rates import at_least
from tendon_newton.effects import EFFECTS

Truth = Mapping[str, Sequence[Mapping[str, float]]]
"""Effect -> its numbers on each bench of the plant."""
Faults = Mapping[str, Mapping[str, float]]
"""Names that are right for a fault, joined by a blank -> signal -> squared change when mended."""
EQUAL = {"gear_load_friction": "load_dependent_friction"}
"""Another name for what a plant's file calls by the second: at constant speed they are one law."""
GEAR = frozenset(
    ("load_dependent_friction", "gear_load_friction", "holding_friction", "load_stribeck_friction")
)
SHAPES = frozenset(
    ("static_force", "static_coefficient", "dissipation", "exponent", "knee", "position", "behind")
)
"""Numbers that shape a law of several beside those that never vanish."""
CLASS = 3  # Names in a class, the named one included; those after are not heard
MATTERS = 0.1  # Share of the squared error from which a fault matters [1]
MOVED = ("theta", "force")  # Signals of which the plant says how far each fault moves them
SURE = 0.9  # Probability from which a name is told as sure [1]


@dataclass(frozen=True, kw_only=True)
class Name:
    """One cause that was named or suspected, held against the plant."""

    name: str
    classmates: tuple[str, ...]
    in_plant: bool  # Whether it or a member of its class is there
    leaves_null: bool  # Whether some size's interval leaves out the value that means nothing
    holds_truth: bool  # Whether all numbers that the plant states lie inside their intervals
    probability: float | None

    @property
    def deserved(self) -> bool:
        """Whether it is right in all three ways."""
        return self.in_plant and self.leaves_null and self.holds_truth

    @property
    def heard(self) -> frozenset[str]:
        """All names that it stands for."""
        return heard_as(self.name, *self.classmates)


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Score of one unit."""

    unit: int
    verdict: str
    gone: float
    """Share of the squared held-out error above the noise that is gone, signals alike [1]."""
    seconds: Mapping[str, float]  # Wall time of each command [s]
    named: tuple[Name, ...]
    suspected: tuple[Name, ...]
    material: Mapping[str, float]
    """Faults that matter -> share of the squared error that each is worth [1]."""
    held: int  # Numbers of the plant that lie inside their 95 % interval
    asked: int  # Numbers that have an interval and that the plant states
    right: str  # Names that stand for something in the plant, joined by a blank

    def recalled(self, names: Iterable[Name]) -> list[str]:
        """Return the faults that matter and that some names or their classes stand for."""
        heard = frozenset[str]().union(*(name.heard for name in names))
        return [fault for fault in self.material if heard & set(fault.split())]

    @property
    def text(self) -> str:
        """The row of a table."""
        missed = set(self.material) - set(self.recalled(self.named))
        return (
            f"{self.unit:4d}  {self.verdict:17s}  {self.gone:6.1%}  "
            f"{self.seconds.get('diagnose', 0.0):6.0f} s  named {len(self.named)}, "
            f"in plant or class {sum(n.in_plant for n in self.named)}, "
            f"deserved {sum(n.deserved for n in self.named)}; "
            f"not deserved: {'; '.join(doubts(self.named)) or 'none'}; "
            f"suspected: {', '.join(n.name for n in self.suspected) or 'none'}; "
            f"missed: {', '.join(sorted(missed)) or 'none'}"
        )


def doubts(names: Iterable[Name]) -> list[str]:
    """Say what is wrong with each name that is not deserved."""
    return [
        name.name
        + ("" if name.in_plant else " not in plant")
        + ("" if name.leaves_null else " holds null")
        + ("" if name.holds_truth else " misses truth")
        for name in names
        if not name.deserved
    ]


def mark(
    unit: int, answer: Mapping[str, Any], truth: Truth, faults: Faults, seconds: Mapping[str, float]
) -> Mark:
    """Hold a unit's ``diagnosis.json`` against its plant."""
    gaps = gaps_of(answer)
    worth = {
        fault: sum(moved[signal] / before for signal, (before, _) in gaps.items()) / len(gaps)
        for fault, moved in faults.items()
    }
    named = tuple(judged(cause, truth) for cause in answer["effects"])
    inside = [hit for cause in answer["effects"] for hit in numbers_held(cause, truth)]
    return Mark(
        unit=unit,
        verdict=answer["verdict"],
        gone=1.0 - sum(after / before for before, after in gaps.values()) / len(gaps),
        seconds=seconds,
        named=named,
        suspected=tuple(judged(cause, truth) for cause in answer.get("suspected", ())),
        material={fault: share for fault, share in worth.items() if share > MATTERS},
        held=sum(inside),
        asked=len(inside),
        right=" ".join(name for name in EFFECTS if not heard_as(name).isdisjoint(truth)),
    )


def gaps_of(answer: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return the squared held-out error above the noise before and after, by signal."""
    gaps: dict[str, tuple[float, float]] = {}
    for signal in MOVED:
        if (noise := answer["noise_floor"].get(signal)) is not None:
            before, after = (answer[k][f"{signal}_rmse"] for k in ("baseline", "extended"))
            gaps[signal] = (before**2 - noise**2, max(0.0, after**2 - noise**2))
    return gaps


def judged(cause: Mapping[str, Any], truth: Truth) -> Name:
    """Judge one entry of ``effects`` or ``suspected``."""
    classmates = tuple(cause["indistinguishable_from"][: CLASS - 1])
    return Name(
        name=cause["name"],
        classmates=classmates,
        in_plant=not heard_as(cause["name"], *classmates).isdisjoint(truth),
        leaves_null=leaves_null(cause["parameters"]),
        holds_truth=all(numbers_held(cause, truth)),
        probability=cause.get("probability"),
    )


def heard_as(*names: str) -> frozenset[str]:
    """Return names with what the plant's file calls them."""
    return frozenset((*names, *(EQUAL[name] for name in names if name in EQUAL)))


def leaves_null(parameters: Mapping[str, Any]) -> bool:
    """Tell whether some size's interval leaves out the value at which it means nothing.

    A law all of whose numbers could be shapes has its size among them.
    """
    strengths = parameters.keys() - SHAPES or parameters.keys()
    sizes = [e for name, e in parameters.items() if e["null"] is not None and name in strengths]
    return any(not low <= e["null"] <= high for e in sizes for low, high in [e["ci95"]])


def numbers_held(cause: Mapping[str, Any], truth: Truth) -> list[bool]:
    """Tell of each number that the plant states whether it lies inside on some bench."""
    held: list[bool] = []
    for name, estimate in cause["parameters"].items():
        stated = [numbers[name] for numbers in truth.get(cause["name"], ()) if name in numbers]
        low, high = estimate["ci95"]
        if stated:
            held.append(any(low <= value <= high for value in stated))
    return held


def summary(marks: Sequence[Mark]) -> dict[str, Any]:
    """Return what many units come to; a rate has its count, its n and its lower 95 % bound."""
    named = [name for each in marks for name in each.named]
    both = [name for each in marks for name in (*each.named, *each.suspected)]
    material = sum(len(each.material) for each in marks)
    geared = [gear for each in marks if (gear := gear_names(each.named))]
    return {
        "units": len(marks),
        "deserved": rate(sum(n.deserved for n in named), len(named)),
        "in_plant_or_class": rate(sum(n.in_plant for n in named), len(named)),
        "deserved_a_unit": sum(n.deserved for n in named) / len(marks),
        "material_faults_named": rate(sum(len(m.recalled(m.named)) for m in marks), material),
        "sure_names_deserved": rate(*hits(n for n in named if (n.probability or 0.0) >= SURE)),
        "with_suspected": {
            "in_plant_or_class": rate(sum(n.in_plant for n in both), len(both)),
            "material_faults": rate(
                sum(len(m.recalled((*m.named, *m.suspected))) for m in marks), material
            ),
        },
        "constant": reached([m.right.split() for m in marks], [[*m.material] for m in marks]),
        "intervals_hold": rate(sum(m.held for m in marks), sum(m.asked for m in marks)),
        "gear_by_one_name": rate(
            max((sum(name in gear for gear in geared) for name in GEAR), default=0), len(geared)
        ),
        "unexplained": sum(m.verdict == "unexplained" for m in marks),
        "gone_median": median(m.gone for m in marks),
        "gone_least": min(m.gone for m in marks),
        "diagnose_seconds_median": median(m.seconds.get("diagnose", 0.0) for m in marks),
    }


def hits(names: Iterable[Name]) -> tuple[int, int]:
    """Return how many of some names are deserved, and how many they are."""
    each = [name.deserved for name in names]
    return sum(each), len(each)


def gear_names(names: Iterable[Name]) -> frozenset[str]:
    """Return the names of a gear's friction by load that an answer has, classes included."""
    return GEAR & frozenset[str]().union(*(name.heard for name in names))


def rate(hit: int, count: int) -> dict[str, float]:
    """Return a rate with Wilson's lower bound at 95 %, one-sided."""
    if count == 0:
        return {"hits": 0, "of": 0}
    return {"hits": hit, "of": count, "rate": hit / count, "at_least": at_least(hit, count)}
