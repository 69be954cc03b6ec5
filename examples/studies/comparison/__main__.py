"""The page that compares everybody on the same logs and splits.

``python -m examples.studies.comparison --xl330 LOGS --sts3215 LOGS --bam PYTHON`` fits and tests
what is missing in ``comparison.json`` and prints the page's tables; ``python -m tests.results
--write`` puts them there. An entry of the file is not made again: delete it to renew it.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from examples.studies.comparison import bam, four_numbers
from examples.studies.comparison.splits import PAIRS, Split, splits_of
from examples.studies.comparison.table import tables
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

RESULTS = Path(__file__).with_name("comparison.json")

Row = dict[str, Any]


def data_sheet(split: Split) -> Row:
    """Test the data sheet, with nothing fitted."""
    return ours(split, split.start, ())


def four(split: Split) -> Row:
    """Fit lag, delay, deadband and offset."""
    train, test = four_numbers.grid_of(split.train), four_numbers.grid_of(split.test)
    begun = time.monotonic()
    found = four_numbers.fitted(train)
    return {
        "held_out": 1e3 * four_numbers.mean_error(test, found),
        "trained": 1e3 * four_numbers.mean_error(train, found),
        "numbers": found.size,
        "seconds": time.monotonic() - begun,
        "says": "lag {:.0f} ms, delay {:.0f} ms, deadband {:.1f} mrad, offset {:.1f} mrad".format(
            *(1e3 * np.abs(found[:3])), 1e3 * found[3]
        ),
    }


def plain(split: Split) -> Row:
    """Fit the motor's numbers and each pair of a list; the best on the training logs counts."""
    return min((ours(split, split.start, pair) for pair in PAIRS), key=lambda row: row["trained"])


def ours(split: Split, model: Model, effects: tuple[str, ...]) -> Row:
    """Fit and test a model of ours; with no effect named nothing is fitted."""
    begun = time.monotonic()
    train = study_of(split.train, model)
    values: dict[int, float] = {}
    if effects:
        worlds = SearchWorlds(train)
        found = fit_set_anew(worlds, model, effects)
        values = values_of(worlds, found.columns, found.place)
    seconds = time.monotonic() - begun
    return {
        "held_out": mean_error(study_of(split.test, model), values),
        "trained": mean_error(train, values),
        "numbers": len(values),
        "seconds": seconds if values else 0.0,
        "says": ", ".join(effects).replace("_", " "),
    }


def diagnosed(split: Split) -> Row:
    """Let a diagnosis choose from the training logs alone."""
    dataset = Dataset(
        path=Path(split.name),
        train=tuple(log.recording for log in split.train),
        test=tuple(log.recording for log in split.test),
    )
    begun = time.monotonic()
    diagnosis, evidence = diagnose(dataset, split.start)
    seconds = time.monotonic() - begun
    values = evidence.extended
    return {
        "held_out": mean_error(study_of(split.test, split.start), values),
        "trained": mean_error(study_of(split.train, split.start), values),
        "numbers": len(values),
        "seconds": seconds,
        "says": ", ".join(effect.name for effect in diagnosis.effects).replace("_", " "),
    }


def of_bam(split: Split, model: str, python: Path, trials: int) -> Row:
    """Fit one of Rhoban/bam's models by their own program."""
    return {**asdict(bam.fit(split, model, python, trials)), "says": f"{trials} trials"}


def study_of(logs: tuple[ImportedLog, ...], model: Model) -> Study:
    """Return logs ready to be compared with a model."""
    return Study([log.recording for log in logs], model, tuple(EFFECTS), time_step=SEARCH_STEP)


def mean_error(study: Study, values: dict[int, float]) -> float:
    """Return the mean absolute error of the angle over logs [mrad]."""
    residuals = study.residuals(*replacements([values]))
    return 1e3 * float(np.mean([np.abs(r.theta[0, r.trusted]).mean() for r in residuals]))


def wanted(name: str, chosen: list[str] | None) -> bool:
    """Tell whether a row or a split is to be made."""
    return chosen is None or name in chosen


def results_in(path: Path) -> dict[str, dict[str, Row]]:
    """Read the results that are kept."""
    return json.loads(path.read_text()) if path.exists() else {}


def keep(path: Path, split: Split, name: str, row: Row) -> None:
    """Add a result to those that are kept, which other runs may have added to meanwhile."""
    results = results_in(path)
    results.setdefault(split.key, {})[name] = row
    path.write_text(json.dumps(results, indent=1) + "\n")


def main() -> None:
    """Make what is missing and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--xl330", type=Path)
    parser.add_argument("--sts3215", type=Path)
    parser.add_argument("--bam", type=Path, help="Python of an environment that has their program")
    parser.add_argument("--trials", type=int, default=1500, help="of each of their fits")
    parser.add_argument("--diagnose", action="store_true", help="let a diagnosis choose as well")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where they are kept")
    parser.add_argument("--row", action="append", help="rows that are made: all by default")
    parser.add_argument("--split", action="append", help="splits that are made: all by default")
    arguments = parser.parse_args()
    makers: dict[str, Callable[[Split], Row]] = {
        "data sheet": data_sheet,
        "four numbers": four,
        "ours, two effects": plain,
    }
    if arguments.diagnose:
        makers["ours, diagnosed"] = diagnosed
    if arguments.bam is not None:
        for model in bam.MODELS:
            makers[f"bam {model}"] = partial(
                of_bam, model=model, python=arguments.bam, trials=arguments.trials
            )
    kept: Path = arguments.results
    for split in splits_of(arguments.xl330, arguments.sts3215):
        if split.floor is not None:
            keep(kept, split, "repeats", {"held_out": split.floor})
        for name, make in makers.items():
            if not wanted(name, arguments.row) or not wanted(split.name, arguments.split):
                continue
            if name not in results_in(kept).get(split.key, {}):
                row = make(split)
                print(f"{split.key}, {name}: {row['held_out']:.1f} mrad, {row}", flush=True)
                keep(kept, split, name, row)
    print(tables(results_in(kept)))


if __name__ == "__main__":
    main()
