"""One answer of an exam against its truth."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Family = Literal["single", "pair", "many", "clean", "outside"]
WORTH_A_SHARE = 1.2
"""A signal whose error is less than so many times the true model's has no gap to remove."""
LARGEST_CLASS = 3  # Names in an answer's class, the named one included; a larger class is no answer


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Hidden causes of one dataset of an exam."""

    id: str
    family: Family
    effects: Mapping[str, Mapping[str, float]]  # True effects with their parameters
    outside: tuple[str, ...]  # Causes that no effect of the catalogue describes
    near: tuple[str, ...]  # Effects that imitate them so well that naming them is no mistake
    weak: bool  # Whether the cause is too weak to be expected
    oracle: Mapping[str, tuple[float, float]] = field(
        default_factory=dict[str, tuple[float, float]]
    )
    """Signal -> held-out RMS error of the starting and of the true model, where they are told."""

    @property
    def causes(self) -> str:
        """All true causes in one word."""
        return "+".join([*self.effects, *self.outside]) or "nothing"


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Answer to one dataset, beside its truth."""

    truth: Truth
    said: tuple[str, ...]  # Effects named, strongest first
    classes: tuple[tuple[str, ...], ...]  # For each the names that it stands for
    verdict: str  # Verdict of the diagnosis, or why there is none
    wall_time_s: float
    parameter_errors: tuple[float, ...]
    """Relative errors of the parameters of exactly named effects."""
    covered: tuple[bool, ...]  # Whether their intervals hold the truth
    gain: float | None = None
    """Held-out squared error that the extended model removes over what the true one does [1]."""
    peak_memory: float | None = None  # Most memory that the process has used so far [MiB]
    earlier: bool = False  # Whether an earlier run of the exam gave the answer

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
        """Number of true effects named, exactly or by class, each answer used once."""
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
        if self.truth.family in ("pair", "many"):
            return self.found == len(self.truth.effects)
        return self.in_class

    @property
    def amiss(self) -> bool:
        """Whether something is missed, or named that is neither there nor near."""
        near = self.truth.family == "outside"
        return not self.right or (not near and len(self.said) > self.found)


def judge(truth: Truth, answer: Mapping[str, Any] | None) -> Mark:
    """Judge one answer (the contents of a diagnosis.json); None counts as wrong."""
    effects = list(answer["effects"]) if answer else []
    errors: list[float] = []
    covered: list[bool] = []
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
        gain=None if answer is None else gain_share(truth, answer),
        peak_memory=None if answer is None else answer.get("peak_memory_mib"),
    )


def gain_share(truth: Truth, answer: Mapping[str, Any]) -> float | None:
    """Return the removed squared error over what the true model removes, signals counting alike.

    None where no signal has a gap, or the truth does not tell.
    """
    shares: list[float] = []
    for signal, (start, true) in truth.oracle.items():
        reached = answer.get("extended", {}).get(signal)
        if start >= WORTH_A_SHARE * true and reached is not None:
            shares.append((start**2 - reached**2) / (start**2 - true**2))
    return sum(shares) / len(shares) if shares else None
