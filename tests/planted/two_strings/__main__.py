"""How often causes are named with their owner: ``python -m tests.planted.two_strings OUT``.

``--cases N --seed S`` draws the sets. OUT keeps sets and answers: a broken-off run goes on.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.exam.exam import ANSWER, answer_one
from tests.planted.two_strings.sets import Recipe, Truth, make_datasets, recipes

NORMAL = 1.96  # half a 95 % interval in standard deviations


def main(arguments: Sequence[str] | None = None) -> None:
    """Make sets, diagnose them and print how often the answer was right."""
    parser = argparse.ArgumentParser(description="Rates of faults with owners, on fresh seeds.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    plan = recipes(chosen.cases, chosen.seed)
    folders = [chosen.out / f"s{recipe.seed}" for recipe in plan]
    truths = make_datasets(folders, plan)
    right = 0
    for folder, truth in zip(folders, truths, strict=True):
        file = folder / "answer" / ANSWER
        if not file.is_file():
            answer_one((folder, file.parent))
        said = read_diagnosis(file)
        right += is_right(said, truth.recipe)
        print(line(said, truth), flush=True)  # noqa: T201 - what it is for
    low, high = interval(right, len(plan))
    print(f"{right} of {len(plan)} right, 95 % interval {low:.0%} to {high:.0%}")  # noqa: T201


def is_right(said: StatedDiagnosis, recipe: Recipe) -> bool:
    """Tell whether the planted cause is named with its owner, and no other; or nothing at all."""
    names = [cause.name for cause in said.effects]
    if recipe.cause is None:
        return said.verdict == "no_gap" and not names
    return names == [recipe.cause]


def line(said: StatedDiagnosis, truth: Truth) -> str:
    """Return one answer beside its truth."""
    planted = truth.recipe.cause or "nothing"
    value = "" if truth.value is None else f" {truth.value:.3g}"
    found = ", ".join(
        f"{c.name} {' '.join(f'{p.value:.3g}' for p in c.parameters.values())}"
        + (f" (or {', '.join(c.indistinguishable_from)})" if c.indistinguishable_from else "")
        for c in said.effects
    )
    mark = "right" if is_right(said, truth.recipe) else "WRONG"
    told = f"{said.verdict}, {found or 'nothing'}; {said.wall_time_s:.0f} s"
    return f"{mark}  {planted}{value}: {told}"


def interval(hits: int, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate [1]."""
    rate, spread = hits / count, NORMAL**2 / count
    middle = (rate + spread / 2.0) / (1.0 + spread)
    half = np.sqrt(rate * (1.0 - rate) * spread + spread**2 / 4.0) / (1.0 + spread)
    return float(middle - half), float(middle + half)


if __name__ == "__main__":
    main()
