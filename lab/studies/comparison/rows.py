"""Rows of the comparison: how each is made of a split, and kept with its origin."""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lab.results.record import measured_on
from lab.studies.comparison import bam, four_numbers
from lab.studies.comparison.splits import Split
from lab.studies.comparison.table import ARM, OURS, REPEATS, rests_on
from lab.studies.so101_pairs import FIXED, TOLD, pooled_rms, squares
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.search.decide.plain_models import PLAIN_MODELS
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

RESULTS = Path(__file__).with_name("comparison.json")

Row = dict[str, Any]

IN_SIGHT = {
    "gear friction by load, viscous, and a sagging supply": (
        "gear_load_friction", "viscous_friction", "voltage_sag",
    ),
}  # fmt: skip
"""A plain model that was chosen with errors of these logs in sight: no diagnosis is given it."""


def data_sheet(split: Split) -> Row:
    """Test the data sheet, with nothing fitted."""
    return ours(split, split.start, None)


def told(split: Split) -> Row:
    """Test a servo that is where it was told to be."""
    return ours(split, TOLD, None)


def four(split: Split) -> Row:
    """Fit lag, delay, deadband and offset."""
    if split.servo == ARM:  # where something solid holds the shaft, as the others are scored
        return ours(split, TOLD, FIXED)
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


def plain(split: Split, effects: tuple[str, ...]) -> Row:
    """Fit a plain model until it moves no more; what the start states already is not added."""
    known = [effect.name for effect in split.start.effects]
    return ours(split, split.start, tuple(e for e in effects if e not in known))


def ours(split: Split, model: Model, effects: tuple[str, ...] | None) -> Row:
    """Fit and test a model of ours with its unknown numbers; with None nothing is fitted."""
    begun = time.monotonic()
    train = study_of(split.train, model)
    values: dict[int, float] = {}
    if effects or (effects is not None and model.fit):
        worlds = SearchWorlds(train)
        found = fit_set_anew(worlds, model, effects)
        values = values_of(worlds, found.columns, found.place)
    seconds = time.monotonic() - begun
    return {
        **errors(split, train, study_of(split.test, model), values),
        "seconds": seconds if values else 0.0,
        "says": ", ".join(effects or ()).replace("_", " "),
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
    train = study_of(split.train, split.start, like=evidence.train)
    return {
        **errors(split, train, evidence.test, evidence.extended),
        "seconds": seconds,
        "says": ", ".join(effect.name for effect in diagnosis.effects).replace("_", " "),
        "verdict": diagnosis.verdict,
        "named": {effect.name: effect.probability for effect in diagnosis.effects},
        "suspected": {effect.name: effect.probability for effect in diagnosis.suspected},
        "rivals": [rival.to_json() for rival in diagnosis.rivals],
    }


def of_bam(split: Split, model: str, python: Path, chosen: argparse.Namespace) -> Row:
    """Fit one of Rhoban/bam's models, from those that it contains if they are kept.

    What another split fitted to the same logs is not looked for again, if that search had ended.
    """
    results, name = results_in(chosen.results), f"bam {model}"
    rows, code = results.get(split.key, {}), measured_on(rests_on(name))["code"]
    alike = [results.get(key, {}).get(name) for key in chosen.alike[split.key]]
    fitted = [row for row in alike if row is not None and row["code"] == code]
    if ended := [row for row in fitted if "not converged" not in row["says"]]:
        return bam.fit(split, model, python, 0.0, ended[:1]) | {
            key: ended[0][key] for key in ("seconds", "says")
        }
    contained = [rows[f"bam {m}"] for m in bam.CONTAINS[model] if f"bam {m}" in rows]
    return bam.fit(split, model, python, chosen.seconds, [*contained, *fitted])


def study_of(logs: tuple[ImportedLog, ...], model: Model, like: Study | None = None) -> Study:
    """Return logs ready to be compared with a model."""
    recordings = [log.recording for log in logs]
    return Study(recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP, like=like)


def errors(split: Split, train: Study, test: Study, values: dict[int, float]) -> Row:
    """Return what a model leaves on the logs of a split, and how many numbers it fitted."""
    score = rms_error if split.servo == ARM else mean_error
    return {
        "held_out": score(test, values),
        "trained": score(train, values),
        "numbers": len(values),
    }


def mean_error(study: Study, values: dict[int, float]) -> float:
    """Return the mean absolute error of the angle over logs [mrad]."""
    residuals = study.residuals(*replacements([values]))
    return 1e3 * float(np.mean([np.abs(r.theta[0, r.trusted]).mean() for r in residuals]))


def rms_error(study: Study, values: dict[int, float]) -> float:
    """Return the RMS error of the angle over all rows in which the shaft is free [mrad]."""
    return 1e3 * pooled_rms(squares(study, [values])[0])


def wanted(name: str, chosen: list[str] | None) -> bool:
    """Tell whether a row or a split is to be made."""
    return chosen is None or name in chosen


def results_in(path: Path) -> dict[str, dict[str, Row]]:
    """Read the results that are kept."""
    return json.loads(path.read_text()) if path.exists() else {}


def keep(path: Path, split: Split, name: str, row: Row) -> None:
    """Add a result to those that are kept, which other runs add to as well."""
    folder = os.open(path.resolve().parent, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    results = results_in(path)
    results.setdefault(split.key, {})[name] = row | measured_on(rests_on(name))
    written = path.with_suffix(".new")
    written.write_text(json.dumps(results, indent=1) + "\n")
    written.replace(path)
    os.close(folder)


def makers_of(split: Split, chosen: argparse.Namespace) -> dict[str, Callable[[Split], Row]]:
    """Return what makes each row of a split, without a diagnosis; Rhoban/bam knows no arm."""
    makers: dict[str, Callable[[Split], Row]] = {"data sheet": data_sheet, "four numbers": four}
    every = {**PLAIN_MODELS, **IN_SIGHT}
    makers |= {name: partial(plain, effects=own) for name, own in every.items()}
    if split.servo == ARM:
        makers["told"] = told
    elif chosen.bam is not None:
        for model in bam.CONTAINS:
            makers[f"bam {model}"] = partial(of_bam, model=model, python=chosen.bam, chosen=chosen)
    return makers


def alike(split: Split, every: Sequence[Split]) -> tuple[str, ...]:
    """Return the keys of the other splits of a servo that train on the same logs."""
    names = [log.recording.name for log in split.train]
    return tuple(
        other.key
        for other in every
        if other.servo == split.servo
        and other.key != split.key
        and [log.recording.name for log in other.train] == names
    )


def waits(kept: dict[str, dict[str, Row]], split: Split, name: str, *, anew: bool) -> bool:
    """Tell whether a row is still to be made."""
    row = kept.get(split.key, {}).get(name)
    return row is None or (anew and row["commit"] != git_commit())


def make_rows(split: Split, chosen: argparse.Namespace) -> None:
    """Make the rows of a split that wait, and keep each."""
    kept: Path = chosen.results
    makers: dict[str, Callable[[Split], Row]] = {}
    if (floor := split.floor) is not None:
        makers[REPEATS] = lambda _: {"held_out": floor}
    makers |= makers_of(split, chosen)
    if chosen.diagnose:
        makers[OURS] = diagnosed
    for name, make in makers.items():
        if wanted(name, chosen.row) and waits(results_in(kept), split, name, anew=chosen.anew):
            row = make(split)
            print(f"{split.key}, {name}: {row['held_out']:.1f} mrad, {row}", flush=True)
            keep(kept, split, name, row)
