"""Answers held against all sets of at most three causes."""

import json
import re
import tarfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.exams.regret.enumeration import LAWS, Bench, bench_of, enumerate_sets, may_win
from lab.studies.comparison.splits import splits_of
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, rescored, start_fits, values_of
from tendon_newton.diagnosis.search.small_sets import STEPS

BEST = 12  # Sets of each round that are refitted to their end
TOLD = 30  # Best sets of each answer that are listed


@dataclass(frozen=True, kw_only=True)
class Logs:
    """What is diagnosed, and where what is found of it is kept."""

    name: str  # Of its files
    kind: str  # Drawn, or the servo of a real split
    dataset: Dataset
    model: Model
    out: Path


def answered(logs: Logs) -> dict[str, Any]:
    """Return the causes of a diagnosis and all numbers of the model that it writes."""
    file = logs.out / "answers" / f"{logs.name}.json"
    if not file.is_file():
        diagnosis, evidence = diagnose(logs.dataset, logs.model)
        owners = evidence.train.table.owners
        told = {
            f"{owners[c][0]}.{owners[c][1].name}": float(v) for c, v in evidence.extended.items()
        }
        written = {cause.rpartition(".")[0] for cause in told}
        causes = [e.name for e in (*diagnosis.effects, *diagnosis.suspected) if e.name in written]
        write_json(file, {"verdict": diagnosis.verdict, "causes": causes, "numbers": told})
    return json.loads(file.read_text(encoding="utf-8"))


def regret_of(
    bench: Bench, causes: Sequence[str], numbers: Mapping[str, float], best: int = BEST
) -> dict[str, Any]:
    """Hold an answer against all sets of at most three causes.

    Args:
        bench: Rows, floors and price of the decision.
        causes: Causes of the answer that the written model has.
        numbers: Numbers of that model in seconds, OWNER.NUMBER -> value; others are as stated.
        best: Sets of each round that are refitted to their end.
    """
    pool, worlds = bench.pool, bench.pool.worlds
    table = worlds.study.table
    own = (c for name in causes for c in table.columns(name))
    values = dict(bench.start)
    for c in (*values, *own, *worlds.study.line_columns(causes)):
        owner, number = table.owners[c]
        values[c] = numbers.get(f"{owner}.{number.name}", worlds.study.base_value(c))
    start = (tuple(causes), worlds.in_seconds(values, -1))
    (told,) = start_fits(worlds, [start], pool.floors, near=True)
    pool.rescore(told, values_of(worlds, told.columns, told.place))  # rows count as they decided
    (told,) = rescored(worlds, [told], pool.floors)
    pool.add(refit(worlds, [told], pool.floors, iterations=STEPS, coarse=0))
    own = pool.fits.get(frozenset(causes), told)
    enumerate_sets(bench, tuple(dict.fromkeys((*LAWS, *causes))), best)
    found = sorted((f for f in pool.fits.values() if may_win(pool, f)), key=pool.cost)
    wins = min(found, key=pool.cost, default=own)
    return {
        "regret": (pool.cost(told) - pool.cost(wins)) / pool.price,
        "regret_refitted": (pool.cost(own) - pool.cost(wins)) / pool.price,
        "answer": row(pool, told),
        "wins": row(pool, wins),
        "sets": [row(pool, fit) for fit in found[:TOLD]],
    }


def row(pool: Pool, fit: Fit) -> dict[str, Any]:
    """Return a set with its cost and its score [nat per row]."""
    return {"causes": list(fit.names), "cost": pool.cost(fit), "score": fit.score}


def take(logs: Logs) -> dict[str, Any]:
    """Return the regret of one answer, and keep it."""
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()
    file = logs.out / "regret" / f"{logs.name}.json"
    if not file.is_file():
        answer = answered(logs)
        bench = bench_of(logs.dataset.train, logs.model, answer["causes"])
        found = regret_of(bench, answer["causes"], answer["numbers"])
        told = {"name": logs.name, "kind": logs.kind, "verdict": answer["verdict"]}
        write_json(file, {**told, **found})
    return json.loads(file.read_text(encoding="utf-8"))


def folders(out: Path, chosen: Sequence[Path]) -> Iterator[Logs]:
    """Return the datasets of folders; a folder may be a dataset, or hold some."""
    for folder in chosen:
        own = [folder] if (folder / "dataset.toml").is_file() else sorted(folder.glob("*/"))
        for each in own:
            if (each / "dataset.toml").is_file():
                yield Logs(
                    name=f"{folder.name}_{each.name}",
                    kind=folder.name,
                    dataset=load_dataset(each),
                    model=load_model(each / "model.toml"),
                    out=out,
                )


def unpacked(packed: Path, out: Path) -> Path:
    """Unpack an archive of logs unless that is done, and return the folder that has them."""
    if not out.is_dir():
        with tarfile.open(packed) as archive:
            archive.extractall(out, filter="data")
    return next((log.parent for log in sorted(out.rglob("*.json"))), out)


def real_splits(out: Path, data: Path) -> Iterator[Logs]:
    """Return the real splits whose logs a folder has; of equal training logs the first."""
    sts3215 = data / "sts3215"
    for packed in sts3215.glob("*.tar.xz"):
        sts3215 = unpacked(packed, out / "sts3215")
    there = [p if p.is_dir() else None for p in (data / "xl330", sts3215, data / "so101")]
    seen = set[tuple[str, ...]]()
    for split in splits_of(*there):
        train = tuple(log.recording for log in split.train)
        key = (split.servo, *(recording.name for recording in train))
        if key not in seen:
            seen.add(key)
            test = tuple(log.recording for log in split.test)
            yield Logs(
                name=re.sub(r"\W+", "_", split.key),
                kind=split.servo,
                dataset=Dataset(path=Path(split.name), train=train, test=test),
                model=split.start,
                out=out,
            )


def summary(found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return by kind how many answers another set would beat by more than a price."""
    kinds = dict.fromkeys(each["kind"] for each in found)
    total: dict[str, Any] = {"commit": git_commit(), "laws": LAWS}
    for kind in kinds:
        own = sorted((f for f in found if f["kind"] == kind), key=lambda f: -f["regret"])
        total[kind] = {
            "sets": len(own),
            "above_a_price": sum(each["regret"] > 1.0 for each in own),
            "above_a_price_refitted": sum(each["regret_refitted"] > 1.0 for each in own),
            "rows": [
                {key: each[key] for key in ("name", "verdict", "regret", "regret_refitted")}
                | {who: each[who]["causes"] for who in ("answer", "wins")}
                for each in own
            ],
        }
    return total
