"""How often the diagnosis is right, on sets that no search has seen: one exam that goes on.

``python -m lab.exams.fresh OUT --jobs 30`` draws every set that has no answer, diagnoses it and
writes OUT/rates.json. A run that broke off goes on. ``--part 3 16`` does the third of sixteen
shares; folders ``truth`` and ``answers`` of several machines may be put together in one OUT.
``--score`` counts the answers that are there. The file says how many sets of each section there
would be, and what constant answers reach (`constant_answers` in `lab/tendon_lab/exam`): fixed
names are chosen on draws of other seeds.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lab.exams.draw import told
from lab.exams.exam_draws import ExamPlan, recipes
from lab.exams.other_sets import make_other, other_recipes
from tendon_lab.exam.constant_answers import Drawn
from tendon_lab.exam.exam_rates import rates
from tendon_lab.exam.exam_score import Family, Mark, judge
from tendon_lab.exam.run_exam import ANSWER, answer_one, read_answer
from tendon_lab.exam.truth_file import read_truth
from tendon_lab.verbs.exam import line
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed
from tests.planted.generator import Recipe, make_dataset
from tests.planted.sets.draws import ALONE, EFFECTS

SEED = 300_000  # First of all seeds; those below 105,000 were used before
APART = 1_000  # Seeds of a section
ELSEWHERE = 10_000_000  # How far away the seeds of the draws are on which fixed answers are chosen
WITHOUT_CELL = tuple(name for name in ALONE if not name.startswith("load_cell"))
SECTIONS: dict[str, ExamPlan] = {
    "single": ExamPlan(cases=63, families=("single",)),
    "pair": ExamPlan(cases=20, families=("pair",)),
    "many": ExamPlan(cases=20, families=("many",)),
    "clean": ExamPlan(cases=30, families=("clean",)),
    "outside": ExamPlan(cases=12, families=("outside",)),
    "form": ExamPlan(cases=24, families=("single",), second_form=True),
    "cell": ExamPlan(cases=20, families=("single",), effects=WITHOUT_CELL, without_force=True),
    "weak": ExamPlan(cases=30, families=("single",), weak_share=1.0),
}
"""What is asked of the first plant."""
OTHER = {"singles": 26, "pairs": 8, "clean": 8}
"""What is asked of the second plant, which has other laws."""

Maker = Callable[[Path], dict[str, Any]]  # Writes a dataset to a folder; returns its truth


def sets_of(seed: int) -> dict[str, Maker]:
    """Return what makes each set, by its name: that of its section, and a number."""
    makers: dict[str, Maker] = {}
    for place, (name, plan) in enumerate(SECTIONS.items()):
        own = recipes(ExamPlan(**{**vars(plan), "seed": seed + APART * place}))
        makers |= {f"{name}{k:03d}": partial(make_first, recipe=r) for k, r in enumerate(own)}
    others = other_recipes(seed + APART * len(SECTIONS), **OTHER)
    return makers | {f"other{k:03d}": partial(make_other, recipe=r) for k, r in enumerate(others)}


def drawn_elsewhere(seed: int) -> dict[str, Drawn]:
    """Return what other draws of each section plant, by family: nothing of them is simulated."""
    seed += ELSEWHERE
    causes = {
        name: [r.effects for r in recipes(ExamPlan(**{**vars(plan), "seed": seed}))]
        for name, plan in SECTIONS.items()
    }
    causes["other"] = [r.effects for r in other_recipes(seed, **OTHER)]
    return {name: by_family(own) for name, own in causes.items()}


def by_family(causes: Sequence[Sequence[str]]) -> Drawn:
    """Return the causes of the catalogue that sets have, by family."""
    out: dict[Family, list[Sequence[str]]] = {}
    for names in causes:
        known = [name for name in names if name in EFFECTS]
        family: Family = ("clean", "single", "pair")[len(known)] if len(known) < 3 else "many"
        out.setdefault("outside" if len(known) < len(names) else family, []).append(known)
    return out


def make_first(out: Path, recipe: Recipe) -> dict[str, Any]:
    """Write a dataset of the first plant; return its truth."""
    return told(out.name, recipe, make_dataset(out, recipe))


def take(out: Path, makers: dict[str, Maker], options: JobOptions) -> Iterator[Mark]:
    """Draw and diagnose all sets without an answer; yield every mark as it comes."""
    waiting: dict[tuple[Path, Path], Maker] = {}
    for name, make in makers.items():
        answers = out / "answers" / name
        if (answer := read_answer(answers / ANSWER)) is None:
            waiting[out / "sets" / name, answers] = make
        else:
            yield judge(read_truth(truth_path(out, name)), answer)
    jobs = [(*paths, make) for paths, make in waiting.items()]
    for (folder, _, _), answer in completed(draw_and_answer, jobs, options):
        yield judge(read_truth(truth_path(out, folder.name)), answer)


def draw_and_answer(job: tuple[Path, Path, Maker]) -> dict[str, Any] | None:
    """Draw a set if it is not there, and diagnose it."""
    folder, answer, make = job
    truth = truth_path(folder.parent.parent, folder.name)
    if not truth.is_file() or not folder.is_dir():
        truth.parent.mkdir(parents=True, exist_ok=True)
        write_json(truth, {**make(folder), "id": folder.name})
    return answer_one((folder, answer))


def truth_path(out: Path, name: str) -> Path:
    """Return where the truth of a set stands."""
    return out / "truth" / f"{name}.json"


def section_of(name: str) -> str:
    """Return the section of a set's name."""
    return name.rstrip("0123456789")


def summary(marks: dict[str, Mark], seed: int) -> dict[str, Any]:
    """Return rates by section, and all answers that are not right."""
    sections, others = dict.fromkeys(map(section_of, marks)), drawn_elsewhere(seed)
    return {
        "seed": seed,
        "sets": len(marks),
        "drawn": Counter(map(section_of, sets_of(seed))),
        "sections": {
            section: {
                rate.name: vars(rate)
                for rate in rates(
                    [m for n, m in marks.items() if section_of(n) == section], others[section]
                )
            }
            for section in sections
        },
        "wrong": {name: line(mark).strip() for name, mark in sorted(marks.items()) if mark.amiss},
    }


def main() -> None:
    """Take the exam, or a share of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--part", type=int, nargs=2, metavar=("K", "N"), help="the K-th of N")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--score", action="store_true", help="count what is there, do nothing anew")
    chosen = parser.parse_args()
    makers = sets_of(chosen.seed)
    if chosen.score:
        answers = chosen.out / "answers"
        makers = {n: m for n, m in makers.items() if read_answer(answers / n / ANSWER) is not None}
    if chosen.part:
        first, step = chosen.part
        makers = dict(list(makers.items())[first - 1 :: step])
    marks: dict[str, Mark] = {}
    for mark in take(chosen.out, makers, JobOptions(jobs=chosen.jobs)):
        marks[mark.truth.id] = mark
        say(f"{len(marks):4d}/{len(makers)}  {line(mark)}")
    if not chosen.part:
        write_json(chosen.out / "rates.json", summary(marks, chosen.seed))
        say(json.dumps(summary(marks, chosen.seed)["sections"], indent=1))


def say(text: str) -> None:
    """Print a line as soon as it is known."""
    print(text, flush=True)  # noqa: T201 - what it is for


if __name__ == "__main__":
    main()
