"""How much better a set the search could have chosen: ``python -m lab.exams.regret OUT --jobs 64``.

Each set of logs is diagnosed, and all sets of at most three causes of a list are scored on the rows
that decided (`enumeration` beside this). *Regret* is the cost of the answer there, in the answer's
own currency, less that of the best enumerated set [prices]. It is negative where the answer is
better.

OUT/sets has 60 drawn sets (``--cases``, ``--seed``). ``--sets FOLDER ...`` adds folders of datasets
with a model.toml each, ``--data DATA`` the real splits of ``lab.studies.comparison`` in its
folders xl330, sts3215 and so101: those with the same training logs count once. Writes
OUT/answers/NAME.json, OUT/regret/NAME.json and OUT/regret.json. A run that broke off goes on;
``--part 3 16`` does the third of sixteen shares, and ``--score`` counts what is there.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from lab.exams.draw import write_exam
from lab.exams.exam_draws import ExamPlan
from lab.exams.fresh import say
from lab.exams.regret.answers import folders, real_splits, summary, take
from tendon_newton.data.files.json_file import write_json
from tendon_newton.scheduler import JobOptions, completed

SEED, CASES = 800_000, 60  # Of the drawn sets


def write_sets(folder: Path, plan: ExamPlan) -> None:
    """Draw sets, all of them or none: shares that begin at once each draw, and the first counts."""
    with TemporaryDirectory(dir=folder.parent) as own:
        write_exam(Path(own) / folder.name, plan)
        with suppress(OSError):  # another was quicker
            (Path(own) / folder.name).rename(folder)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the regret of each answer, and write what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--sets", type=Path, nargs="+", default=[], help="folders of datasets")
    parser.add_argument("--data", type=Path, help="folder with xl330, sts3215 and so101")
    parser.add_argument("--cases", type=int, default=CASES, help="drawn sets; 0 draws none")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--part", type=int, nargs=2, metavar=("K", "N"), help="the K-th of N")
    parser.add_argument("--score", action="store_true", help="count what is there, do nothing anew")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    for name in ("answers", "regret"):
        (chosen.out / name).mkdir(parents=True, exist_ok=True)
    planted = chosen.out / "sets"
    if chosen.cases and not planted.is_dir():
        write_sets(planted, ExamPlan(cases=chosen.cases, seed=chosen.seed))
    drawn = [planted] if chosen.cases else []
    logs = list(folders(chosen.out, [*drawn, *chosen.sets]))
    if chosen.data is not None:
        logs += real_splits(chosen.out, chosen.data)
    if chosen.score:
        logs = [each for each in logs if (chosen.out / "regret" / f"{each.name}.json").is_file()]
    if chosen.part:
        first, step = chosen.part
        logs = logs[first - 1 :: step]
    found: list[dict[str, Any]] = []
    for _, each in completed(take, logs, JobOptions(jobs=chosen.jobs)):
        found.append(each)
        wins = ", ".join(each["wins"]["causes"]) or "nothing"
        said = ", ".join(each["answer"]["causes"]) or "nothing"
        say(f"{each['regret']:8.2f} {each['name']}: {said}; best: {wins}")
    if not chosen.part:
        write_json(chosen.out / "regret.json", summary(found))


if __name__ == "__main__":
    main()
