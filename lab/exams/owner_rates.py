"""How often causes are named with their owner: ``python -m lab.exams.hand OUT``, say.

``--cases N --seed S`` draws the sets, of some ``--faults`` where these are given. OUT keeps sets
and answers: a broken-off run goes on with the sets that have no answer yet. ``--jobs N`` shares
the cores among so many processes.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_lab.exam.run_exam import ANSWER, answer_one
from tendon_newton.data.servo_names import servo_of
from tendon_newton.diagnosis.diagnosis_file import StatedDiagnosis, read_diagnosis
from tendon_newton.effects import law_of
from tendon_newton.scheduler import JobOptions, completed
from tests.planted.owners.checks import is_right
from tests.planted.owners.sets import (
    OF_MECHANISM,
    SILENT,
    Bench,
    Recipe,
    make_datasets,
    recipes,
    truth_of,
)

NORMAL = 1.96  # half a 95 % interval in standard deviations


def main(bench: Bench, arguments: Sequence[str] | None = None) -> None:
    """Make sets of a bench, diagnose them and print how often the answer was right."""
    parser = argparse.ArgumentParser(description="Rates of faults with owners, on fresh seeds.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--faults", nargs="+", choices=sorted({kind for kind, _ in bench.kinds}))
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    drawn = recipes(bench, chosen.cases, chosen.seed, chosen.faults or ())
    plan = {chosen.out / f"s{recipe.seed}": recipe for recipe in drawn}
    new = {folder: r for folder, r in plan.items() if not (folder / "dataset.toml").is_file()}
    if new:
        make_datasets(list(new), list(new.values()))
    waiting = [folder for folder in plan if not (folder / "answer" / ANSWER).is_file()]
    right: list[bool] = []
    sound: list[bool] = []
    for folder in plan:
        if folder not in waiting:
            mark(folder, plan[folder], right, sound)
    pairs = [(folder, folder / "answer") for folder in waiting]
    for (folder, _), _ in completed(answer_one, pairs, JobOptions(jobs=chosen.jobs)):
        mark(folder, plan[folder], right, sound)
    say(f"right, and nothing besides: {rate(right)}; no fault on a sound servo: {rate(sound)}")


def mark(folder: Path, recipe: Recipe, right: list[bool], sound: list[bool]) -> None:
    """Print one answer beside its truth, and keep what it is worth."""
    file = folder / "answer" / ANSWER
    if not file.is_file():
        say(f"REFUSED  {recipe.cause}: {(file.parent / 'error.txt').read_text().strip()}")
        right.append(False)
        return
    said = read_diagnosis(file)
    right.append(is_right(said, recipe))
    sound.append(blamed(said) <= faulty(recipe))
    say(f"{'right' if right[-1] else 'WRONG'}  {folder.name} {line(said, recipe)}")


def blamed(said: StatedDiagnosis) -> set[int | None]:
    """Return the servos of which a cause is named; None stands for all."""
    named = {cause.name: servo_of(cause.name) for cause in said.effects}
    return {own for name, own in named.items() if own is not None or law_of(name).is_of_servo()}


def faulty(recipe: Recipe) -> set[int | None]:
    """Return the servos of which a cause may be named."""
    of_no_servo = recipe.fault in OF_MECHANISM and recipe.bench.fingers == 1
    if recipe.fault == SILENT or of_no_servo:
        return set()
    return {None, *range(recipe.bench.servos)} if recipe.servo is None else {recipe.servo}


def line(said: StatedDiagnosis, recipe: Recipe) -> str:
    """Return one answer beside its truth."""
    truth = truth_of(recipe)
    value = "" if truth.value is None else f" {truth.value:.3g}"
    found = ", ".join(
        f"{c.name} {' '.join(f'{p.value:.3g}' for p in c.parameters.values())}"
        + (f" (or {', '.join(c.indistinguishable_from)})" if c.indistinguishable_from else "")
        for c in said.effects
    )
    told = f"{said.verdict}, {found or 'nothing'}; {said.wall_time_s:.0f} s"
    return f"{recipe.cause or 'nothing'}{value}: {told}"


def rate(hits: Sequence[bool]) -> str:
    """Return how often something was so, with Wilson's 95 % interval."""
    count = len(hits)
    share, spread = sum(hits) / max(1, count), NORMAL**2 / max(1, count)
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = np.sqrt(share * (1.0 - share) * spread + spread**2 / 4.0) / (1.0 + spread)
    return f"{sum(hits)} of {count} [{middle - half:.0%} to {middle + half:.0%}]"


def say(text: str) -> None:
    """Print a line as soon as it is known."""
    print(text, flush=True)  # noqa: T201 - what it is for
