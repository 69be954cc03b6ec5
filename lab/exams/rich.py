"""Benches of the second plant with a dozen small imperfections and two faults that matter.

``python -m lab.exams.rich OUT --sets 12 --jobs N`` draws the sets that have no answer, diagnoses
them from the drawing and a calibrated load cell, and writes OUT/rich.json: the strict score of
``lab.studies.unit_score``. A run that broke off goes on; ``--only N`` does one set.
"""

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lab.exams.exam_draws import are_alike
from lab.exams.other_plant import BRISTLE
from lab.exams.other_sets import BENCHES, DRAWS, ON_FINGER, Draw, OtherRecipe, drawn, one, write_set
from lab.studies.unit_score import Mark, mark, rate, summary
from tendon_lab.exam.constant_answers import reached
from tendon_lab.exam.run_exam import ANSWER, answer_one, read_answer
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed

SEED = 400_000
IMPERFECTIONS = 12
OFF = 0.03  # Share by which masses and lengths are off their drawing [1]
SMALL: Mapping[str, Draw] = {
    "gain_error": one("scale", "gain", 0.01, 0.04, signed=True),
    "command_delay": one("delay", "delay", 0.001, 0.004),
    "actuator_lag": one("time_constant", "lag", 0.002, 0.006),
    "deadband": one("width", "deadband", 0.005, 0.02),
    "coulomb_friction": one("force", "coulomb", 0.1, 0.3),
    "viscous_friction": one("coefficient", "viscous", 0.05, 0.2),
    "load_dependent_friction": one("coefficient", "load", 0.01, 0.04),
    "voltage_sag": one("sag", "sag", 0.002, 0.008),
    "routing_friction": one("exponent", "routing", 0.01, 0.04),
    "spool_radius_error": one("scale", "radius", 0.003, 0.01, signed=True),
    "joint_stiffness_error": one("scale", "stiffness", 0.01, 0.05, signed=True),
    "joint_damping_error": one("scale", "damping", 0.05, 0.3, signed=True),
    "spring_stiffening": one("beta", "stiffening", 0.02, 0.08),
    "gravity_misalignment": one("angle", "tilt", 0.01, 0.05, signed=True),
    "position_offset": one("angle", "offset", 0.003, 0.01, signed=True),
    "load_cell_bias": one("offset", "cell_bias", 0.02, 0.1, signed=True),
    "load_cell_gain": one("scale", "cell_gain", 0.003, 0.015, signed=True),
    "load_cell_lag": one("time_constant", "cell_lag", 0.002, 0.006),
}
"""Imperfections of a bench that was built and calibrated with care."""


def recipe_of(number: int) -> tuple[OtherRecipe, dict[str, Draw], tuple[str, ...]]:
    """Draw a bench: its recipe, all its causes, and the two of them that matter."""
    rng = np.random.default_rng(SEED + number)
    while True:
        two = tuple(map(str, rng.choice(list(DRAWS), size=2, replace=False)))
        if not are_alike(two):
            break
    draws = {name: DRAWS[name] for name in two}
    taken = numbers_of(*draws.values())
    small = [name for name in map(str, rng.permutation(list(SMALL)))
             if taken.isdisjoint(numbers_of(SMALL[name]))]  # fmt: skip
    draws |= {name: SMALL[name] for name in small[:IMPERFECTIONS]}
    benches = BENCHES[0 if ON_FINGER & set(two) else number % 2]
    return OtherRecipe(effects=two, seed=SEED + number, benches=benches), draws, two


def numbers_of(*draws: Draw) -> set[str]:
    """Return the numbers of the plant that draws state: each is of one cause at most."""
    return set().union(*(draw(np.random.default_rng(0))[1] for draw in draws))


def name_of(number: int) -> str:
    """Return a set's name."""
    return f"rich{number:03d}"


def set_of(out: Path, number: int) -> dict[str, Any]:
    """Write a set if it is not there; return its truth."""
    truth = out / "truth" / f"{name_of(number)}.json"
    if not truth.is_file():
        recipe, draws, two = recipe_of(number)
        rng = np.random.default_rng(recipe.seed + 500)
        told, own = drawn(rng, draws)
        changes = write_set(
            out / "sets" / truth.stem, rng, recipe, own, without=[(name,) for name in own], off=OFF
        )
        truth.parent.mkdir(parents=True, exist_ok=True)
        faults = dict(zip(own, changes, strict=True))
        write_json(truth, {"effects": told, "planted": two, "moves": faults})
    return json.loads(truth.read_text(encoding="utf-8"))


def take(job: tuple[Path, int]) -> tuple[Mark, tuple[str, ...]]:
    """Diagnose a set if it has no answer; return its mark, and which planted faults were named."""
    out, number = job
    truth, folder = set_of(out, number), out / "answers" / name_of(number)
    answer = read_answer(folder / ANSWER)
    answer = answer or answer_one((out / "sets" / folder.name, folder))
    if answer is None:
        raise RuntimeError(f"{folder}/error.txt: a bench of the exam was refused")
    moves = {
        name: {"force": force**2, "theta": theta**2}
        for name, (force, theta) in truth["moves"].items()
    }
    effects = {"presliding": [{"travel": BRISTLE}]}  # of every dry friction of the second plant
    effects |= {name: [numbers] for name, numbers in truth["effects"].items()}
    found = mark(number, answer, effects, moves, {"diagnose": answer["wall_time_s"]})
    heard = frozenset[str]().union(*(name.heard for name in found.named))
    return found, tuple(name for name in truth["planted"] if name in heard)


def main() -> None:
    """Print a row for each bench and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--sets", type=int, default=12)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of sets")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    numbers = range(chosen.sets) if chosen.only is None else chosen.only
    marks: list[Mark] = []
    found = 0
    jobs = [(chosen.out, number) for number in numbers]
    for _, (each, planted) in completed(take, jobs, JobOptions(jobs=chosen.jobs)):
        marks.append(each)
        found += len(planted)
        print(f"{each.text}; planted found: {', '.join(planted) or 'none'}", flush=True)  # noqa: T201
    marks.sort(key=lambda each: each.unit)
    total = {**summary(marks), "planted_found": rate(found, 2 * len(marks))}
    planted = [set_of(chosen.out, each.unit)["planted"] for each in marks]
    total["constant_planted"] = reached([m.right.split() for m in marks], planted)["faults"]
    write_json(chosen.out / "rich.json", {"summary": total, "sets": [asdict(m) for m in marks]})
    print(json.dumps(total, indent=1))  # noqa: T201


if __name__ == "__main__":
    main()
