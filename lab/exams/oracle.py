"""Which planted causes could be named at all: ``python -m lab.exams.oracle OUT --jobs 30``.

OUT is that of ``lab.exams.fresh``, ``rich`` or ``units42``. Where an answer missed a cause, the
same decision begins anew at all true causes with their numbers, and at the answer. Other forms of
the true friction are tried in its place, since a plant's is no law's of ours. A cause that the
decision does not keep is not in the data: it is worth less than a name costs, or other causes
explain as much. Writes OUT/oracle/NAME.json and counts.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lab.exams import rich, units42
from lab.exams.fresh import say, truth_path
from lab.exams.regret.enumeration import STEPS, bench_of
from tendon_lab.exam.exam_score import Truth, judge
from tendon_lab.exam.run_exam import ANSWER, read_answer
from tendon_lab.exam.truth_file import read_truth
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.search.decide.decision import fit_replacements, tested
from tendon_newton.diagnosis.search.prune import prune
from tendon_newton.diagnosis.search.refit import refit, start_fits
from tendon_newton.effects import are_related
from tendon_newton.scheduler import JobOptions, completed

Causes = Mapping[str, Mapping[str, float]]  # Their numbers by name


def kept(folder: Path, true: Causes, said: Causes) -> tuple[str, ...]:
    """Return the causes that the decision keeps if it begins at the true ones, and at an answer's.

    Args:
        folder: Folder of the dataset.
        true: Causes with their numbers; of a law and its special case the first counts.
        said: Causes of the answer with their numbers.
    """
    dataset, model = load_dataset(folder), load_model(folder / "model.toml")
    bench = bench_of(dataset.train, model, tuple(true))
    pool, worlds, testable = bench.pool, bench.pool.worlds, bench.testable
    study = worlds.study

    def add(causes: Causes) -> frozenset[str]:
        names = list[str]()
        for name in causes:
            if name in testable and not any(are_related(name, other) for other in names):
                names.append(name)
        own = {
            c: causes[name].get(study.parameter(c).name, study.parameter(c).nominal)
            for name in names
            for c in study.table.columns(name)
        }
        start = (tuple(names), worlds.in_seconds({**bench.start, **own}, -1))
        begun = start_fits(worlds, [start], pool.floors, near=True)
        pool.add(refit(worlds, begun, pool.floors, iterations=STEPS, coarse=0))
        return frozenset(names)

    begun = pool.renew(pool.fits[add(true)])
    fit_replacements(pool, begun, [name for name in testable if name not in begun.names])
    prune(pool, pool.best())
    add(said)
    add({})
    return tested(pool, prune(pool, pool.best()), testable).fit.names


def missed(truth: Truth, answer: Mapping[str, object]) -> tuple[str, ...]:
    """Return the planted causes that an answer names neither exactly nor in a class."""
    said = {name for names in judge(truth, answer).classes for name in names}
    return tuple(name for name in truth.effects if name not in said)


def asked(out: Path, name: str, answer: Mapping[str, Any]) -> tuple[Causes, tuple[str, ...]]:
    """Return the true causes of a set with their numbers, and the planted ones that were missed."""
    for exam in (rich, units42):
        section, number = name.rstrip("0123456789"), name[-3:]
        if exam.name_of(0).startswith(section):
            truth, (_, found) = exam.set_of(out, int(number)), exam.take((out, int(number)))
            planted = {**dict.fromkeys(truth["planted"]), **truth["effects"]}
            effects = {n: own[0] if isinstance(own, list) else own for n, own in planted.items()}
            return effects, tuple(n for n in truth["planted"] if n not in found)
    truth = read_truth(truth_path(out, name))
    return truth.effects, missed(truth, answer)


def ask(job: tuple[Path, str]) -> dict[str, bool]:
    """Return for each missed cause of an answer whether it could be named, and keep that."""
    out, name = job
    file = out / "oracle" / f"{name}.json"
    if file.is_file():
        return json.loads(file.read_text(encoding="utf-8"))
    answer = read_answer(out / "answers" / name / ANSWER)
    assert answer is not None, name
    true, lost = asked(out, name, answer)
    said = {
        cause["name"]: {number: own["value"] for number, own in cause["parameters"].items()}
        for cause in (*answer["effects"], *answer.get("suspected", ()))
    }
    seen = kept(out / "sets" / name, true, said) if lost else ()
    found = {c: any(c == other or are_related(c, other) for other in seen) for c in lost}
    file.parent.mkdir(exist_ok=True)
    write_json(file, found)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Ask for all answers of an exam."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    answered = sorted(path.parent.name for path in (chosen.out / "answers").glob(f"*/{ANSWER}"))
    jobs, counts = [(chosen.out, name) for name in answered], dict[str, list[int]]()
    for (_, name), found in completed(ask, jobs, JobOptions(jobs=chosen.jobs)):
        own = counts.setdefault(name.rstrip("0123456789"), [0, 0])
        own[0] += len(found)
        own[1] += sum(found.values())
        for cause, could in found.items():
            say(f"{name}  {cause}  {'could be named' if could else 'is not in the data'}")
    for section, (lost, could) in counts.items():
        say(f"{section}: {lost} missed, {could} of them could be named")


if __name__ == "__main__":
    main()
