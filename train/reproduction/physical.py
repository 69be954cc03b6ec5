"""The physical model: what a diagnosis names on a bench's recordings, and how much of it there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.toml_file import read_toml
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.diagnose import SEARCH_STEP, diagnose, extended_model
from tendon_newton.diagnosis.greedy import Search, values_of
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.errors import InvalidDataset
from tendon_newton.identification.least_squares import Candidate, refine
from tendon_newton.identification.study import Study

SPOOL_RADIUS = 0.0125
"""[m], of the paper."""
DATA_SHEET = {
    "duty_per_rad": 0.10,
    "max_duty": 0.90,
    "supply_voltage": 9.0,
    "torque_constant": 1.43,
    "resistance": 15.0,
    "armature": 0.0025,
    "spool_radius": SPOOL_RADIUS,
}
"""What is known of the paper's servo before anything is measured: the position loop of its host,
and the row of 9.0 V in the e-manual of the XC330-T288-T. The rotor's inertia is a guess."""
UNKNOWN = ("torque_constant", "resistance")
"""Numbers of it that every fit may change."""
REFITS = ((6, 1.0e-3), (6, SEARCH_STEP))
"""Iterations and simulation step [s] of a refit; the scale of the gap is taken anew before each."""


def starting_model() -> Model:
    """Return the servo's data sheet."""
    return Model(actuator=NamedValues(name="pwm_servo", values=DATA_SHEET), fit=UNKNOWN)


def diagnose_in_passes(
    dataset: Dataset, passes: int, progress: Callable[[str], None]
) -> tuple[Model, tuple[Diagnosis, ...]]:
    """Diagnose, and go on from the extended model until nothing more is named.

    A diagnosis names three causes at most; a bench has more.

    Returns:
        The extended model, and the diagnoses.
    """
    model, found = starting_model(), []
    for _ in range(passes):
        diagnosis, _ = diagnose(dataset, model, progress=progress)
        found.append(diagnosis)
        if not diagnosis.effects:
            break
        model = diagnosis.model
    return model, tuple(found)


def refit(dataset: Dataset, model: Model) -> Model:
    """Return a model with its causes as they are and their numbers fitted to other recordings."""
    names = tuple(effect.name for effect in model.effects)
    study = Study(dataset.train, model, names, time_step=SEARCH_STEP)
    search = Search(study, model)
    candidate = own_numbers(search, names)
    for iterations, time_step in REFITS:
        simulate = search.simulate_at(search.gap_scales(candidate), time_step)
        (candidate,) = refine(simulate, [candidate], iterations=iterations)
    return extended_model(search.study, model, values_of(candidate), names)


def own_numbers(search: Search, names: tuple[str, ...]) -> Candidate:
    """Return all numbers of a model's causes, and its unknown ones, as they stand."""
    table = search.study.table
    columns = (*search.fit_columns, *(c for name in names for c in table.columns(name)))
    parameters = [table.owners[column][1] for column in columns]
    lower, upper = (np.array([getattr(p, side) for p in parameters]) for side in ("lower", "upper"))
    value = np.clip([search.study.base_value(c) for c in columns], lower, upper)
    return Candidate(name="refit", columns=columns, lower=lower, upper=upper, value=value)


def with_ideal(gain: float) -> Model:
    """Return the ideal source and nothing else."""
    values = {"gain": gain, "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="ideal", values=values))


def true_effects(folder: Path) -> dict[str, dict[str, dict[str, float]]]:
    """Return bench -> effect -> parameters out of the plant files beside virtual recordings."""
    out: dict[str, dict[str, dict[str, float]]] = {}
    for path in sorted(folder.glob("plant_*.toml")):
        table: dict[str, Any] = read_toml(path, InvalidDataset, "a plant file is TOML")
        effects = {row["name"]: row.get("parameters", {}) for row in table["effects"]}
        out[table["bench"]] = effects
    return out
