"""Three faults of the whole catalogue on benches with many imperfections.

``python -m lab.exams.units42 OUT --sets 60 --jobs N`` draws the sets that have no answer, diagnoses
them and writes OUT/units42.json; a run that broke off goes on. ``python -m lab.exams.oracle OUT``
says which of the missed faults could be named.

Even numbers are virtual units, new but for three faults that their constants can have
(`VIRTUAL`). Odd ones are benches of the tests' plant, whose masses and lengths are off by 3 %
and which have nine effects of the catalogue at a tenth of their size. Their three faults are drawn
from the whole catalogue but for play, which a string under tension closes. Sizes are beyond every
tolerance that is stated. A fixed answer has the three names drawn most often at other numbers.
"""

import argparse
import json
import random
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lab.exams.exam_draws import MIX_SHARES, draw_many, draw_mix
from lab.studies.unit_score import Mark, mark, rate, summary
from lab.studies.units import truth_of
from tendon_hardware.virtual_bench.physics.unit import BenchUnit
from tendon_hardware.virtual_bench.physics.wear import PLANTINGS, WEARS, Planting
from tendon_lab.exam.constant_answers import most_frequent, share
from tendon_lab.exam.run_exam import ANSWER, answer_one, read_answer
from tendon_newton.cli import main as program
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed
from tests.planted.generator import Recipe, make_dataset
from tests.planted.sets.draws import ALONE, EFFECTS, MIX_OF

SEED = 900_000
FAULTS, SMALL = 3, 9  # Faults that are asked for, and effects at a tenth of their size
OFF = 0.03  # Share by which masses and lengths are off their drawing [1]
WEAR = "units42"  # What the virtual bench calls such a unit, in this process
ELSEWHERE = 1000  # Numbers of other sets on which the fixed answer is chosen: from here, as many


def scaled(part: str, *names: str) -> Callable[[BenchUnit, float], BenchUnit]:
    """Return what multiplies those constants of a part that a unit has."""

    def plant(unit: BenchUnit, factor: float) -> BenchUnit:
        own: Any = getattr(unit, part)
        there = {name: getattr(own, name) for name in names if hasattr(own, name)}
        changed = {
            name: tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
            for name, value in there.items()
        }
        return replace(unit, **{part: replace(own, **changed)})

    return plant


def drifting(unit: BenchUnit, rate: float) -> BenchUnit:
    """Let the load cell drift [N/s]."""
    return replace(unit, load_cell=replace(unit.load_cell, drift=rate))


VIRTUAL: Mapping[str, Planting] = {
    **PLANTINGS,
    "stribeck_friction": Planting(sizes=(2.0, 3.0), plant=scaled("servo", "dry_friction")),
    "voltage_sag": Planting(sizes=(5.0, 10.0), plant=scaled("servo", "supply_resistance")),
    "routing_friction": Planting(sizes=(4.0, 7.0), plant=scaled("tendon", "guide_friction")),
    "joint_damping_error": Planting(sizes=(3.0, 5.0), plant=scaled("mechanism", "damping")),
    "inertia_error": Planting(sizes=(1.6, 2.2), plant=scaled("mechanism", "mass", "masses")),
    "joint_dry_friction": Planting(sizes=(4.0, 8.0), plant=scaled("mechanism", "rail_friction")),
    "viscoelastic_spring": Planting(sizes=(2.0, 3.0), plant=scaled("mechanism", "maxwell_ratio")),
    "spring_stiffening": Planting(sizes=(4.0, 8.0), plant=scaled("mechanism", "pad_stiffness")),
    "load_cell_drift": Planting(sizes=(0.02, 0.05), plant=drifting),
}
"""Effects whose fault a unit's constants can have, beyond what its parts scatter."""


def name_of(number: int) -> str:
    """Return a set's name."""
    return f"units42_{number:03d}"


def faults_of(number: int) -> tuple[str, ...]:
    """Draw the faults of a set."""
    rng = np.random.default_rng(SEED + number)
    return draw_many(rng, [*VIRTUAL] if number % 2 == 0 else [*ALONE], FAULTS)


def recipe_of(number: int) -> Recipe:
    """Draw a bench of the tests' plant with its imperfections."""
    rng, faults = np.random.default_rng([SEED, number]), faults_of(number)
    others = [name for name in ALONE if name not in (*faults, *MIX_OF)]
    return Recipe(
        effects=faults,
        small=draw_many(rng, others, SMALL),
        seed=SEED + number,
        mix=draw_mix(rng, [*MIX_SHARES], faults),
        off_nominal=OFF,
        imperfection=1.0,
    )


def planted_unit(faults: tuple[str, ...], unit: BenchUnit, _: random.Random) -> BenchUnit:
    """Return a virtual unit with some faults, of the same size on every bench of its seed."""
    for name in faults:
        size = random.Random(f"{WEAR} {name} {unit.seed}").uniform(*VIRTUAL[name].sizes)
        unit = VIRTUAL[name].plant(unit, size)
    return unit


def set_of(out: Path, number: int) -> dict[str, Any]:
    """Write a set if it is not there; return its truth: all effects by bench, and the faults."""
    truth, folder = out / "truth" / f"{name_of(number)}.json", out / "sets" / name_of(number)
    if not truth.is_file():
        faults = faults_of(number)
        if number % 2 == 0:
            WEARS[WEAR] = partial(planted_unit, faults)
            port = f"virtual::{SEED + number}:{WEAR}"
            command = ["collect", "--plan", "quick", "--port", port, "--out", str(folder)]
            program([*command, "--faster-than-real-time"])
            effects = truth_of(folder)
        else:
            told = make_dataset(folder, recipe_of(number))
            effects = {name: [dict(own)] for name, own in told.parameters.items()}
        truth.parent.mkdir(parents=True, exist_ok=True)
        write_json(truth, {"effects": effects, "planted": faults})
    return json.loads(truth.read_text(encoding="utf-8"))


def take(job: tuple[Path, int]) -> tuple[Mark, tuple[str, ...]]:
    """Diagnose a set if it has no answer; return its mark, and which faults were named."""
    out, number = job
    truth, folder = set_of(out, number), out / "answers" / name_of(number)
    answer = read_answer(folder / ANSWER) or answer_one((out / "sets" / folder.name, folder))
    if answer is None:
        raise RuntimeError(f"{folder}/error.txt: a bench of the exam was refused")
    found = mark(number, answer, truth["effects"], {}, {"diagnose": answer["wall_time_s"]})
    heard = frozenset[str]().union(*(name.heard for name in found.named))
    return found, tuple(name for name in truth["planted"] if name in heard)


def fixed_share(numbers: list[int]) -> float | None:
    """Return the share of the faults that the names find that are drawn most often elsewhere."""
    elsewhere = [faults_of(number + ELSEWHERE) for number in numbers]
    names = most_frequent(elsewhere, FAULTS)
    return share([name in names for number in numbers for name in faults_of(number)])


def counted(marks: Mapping[int, Mark], found: Mapping[int, tuple[str, ...]]) -> dict[str, Any]:
    """Return what some sets come to."""
    numbers = sorted(marks)
    hits = sum(len(found[number]) for number in numbers)
    return {
        **summary([marks[number] for number in numbers]),
        "planted_found": rate(hits, FAULTS * len(numbers)),
        "constant_planted": {"fixed": fixed_share(numbers), "random": FAULTS / len(EFFECTS)},
    }


def main() -> None:
    """Print a row for each set and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of sets")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    numbers = list(range(chosen.sets)) if chosen.only is None else chosen.only
    marks: dict[int, Mark] = {}
    found: dict[int, tuple[str, ...]] = {}
    jobs = [(chosen.out, number) for number in numbers]
    for (_, number), (own, named) in completed(take, jobs, JobOptions(jobs=chosen.jobs)):
        marks[number], found[number] = own, named
        planted = ", ".join(faults_of(number))
        print(f"{own.text}; planted {planted}; found: {', '.join(named) or 'none'}", flush=True)  # noqa: T201
    kinds = {"virtual": [n for n in marks if n % 2 == 0], "plant": [n for n in marks if n % 2]}
    total = {kind: counted({n: marks[n] for n in own}, found) for kind, own in kinds.items() if own}
    rows = [{**asdict(marks[n]), "planted": faults_of(n), "found": found[n]} for n in sorted(marks)]
    write_json(chosen.out / "units42.json", {"summary": total, "sets": rows})
    print(json.dumps(total, indent=1))  # noqa: T201


if __name__ == "__main__":
    main()
