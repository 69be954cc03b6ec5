"""Has a bench drifted from its model? What wear could have done to it, tried on its logs."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import SEED, Evidence, conclude
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.decide.find_causes import find_causes
from tendon_newton.diagnosis.search.fixed_set import as_stated, fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.identification.study import Study
from tendon_newton.identification.testable import testable_effects

STEP = 1.0e-3
"""Simulation step while searching [s]: twice that of a diagnosis, whose effects may be finer than
wear; the reported errors use the simulator's own."""


@dataclass(frozen=True, kw_only=True)
class Wear:
    """What use does to a bench, as an effect whose first number it changes."""

    # Least value that use leads to [the number's unit]; None where it only makes larger what the
    # model has
    low: float | None = None
    high: float = inf  # Greatest value that counts as wear


SUSPECTS: dict[str, Wear] = {
    "coulomb_friction": Wear(),
    "viscous_friction": Wear(),
    # hobby servos lose 10 to 40 % in the gear; with more they pull nothing
    "load_dependent_friction": Wear(high=0.5),
    "holding_friction": Wear(high=0.7),
    "routing_friction": Wear(),
    "joint_dry_friction": Wear(),
    # a spring that lost more than a third is torn, and the finger no longer opens
    "joint_stiffness_error": Wear(low=0.6, high=1.1),
    "tendon_slack": Wear(),
    "position_offset": Wear(low=-inf),
    "spool_radius_error": Wear(low=0.98, high=1.3),
    "gain_error": Wear(low=0.4, high=1.05),
    "obstruction": Wear(low=0.0),
}
"""What wear looks like to a diagnosis, and how far it goes: a fit that ends beyond stands for
something else."""


def find_drift(
    dataset: Dataset,
    model: Model,
    *,
    suspects: Sequence[str] = tuple(SUSPECTS),
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose logs against the model that fitted the bench, with wear alone as the catalogue.

    The search and the rule are those of `tendon_newton.diagnosis`, for one cause: the one that
    explains most. A second one would have to be told from what the model has always left; it shows
    when the first is in the model. What the model has already and got worse is named with its new
    total. Numbers that the model declares unknown were found when the bench was new, and stay: else
    a weak motor makes up for friction.

    Args:
        dataset: Logs; test parts only report.
        model: Model that fitted the bench when it was new.
        suspects: Effects that may be named.
        progress: Told, in a few words, what is being done.
    """
    known_model = replace(model, fit=())
    start = time.monotonic()
    rng = np.random.default_rng(SEED)
    effects = tuple(dict.fromkeys([*(effect.name for effect in model.effects), *suspects]))
    train = Study(dataset.train, known_model, effects, time_step=STEP, in_segments=True)
    names = [name for name in testable_effects(train) if name in suspects]
    progress(f"trying {len(names)} kinds of wear on {len(dataset.train)} logs")
    findings = find_causes(
        dataset.train,
        train,
        known_model,
        names,
        most=1,
        allows=lambda causes, values: are_likely(train, causes, values),
    )
    test = Study(dataset.test, known_model, effects)
    diagnosis, evidence = conclude(train, findings, known_model, test, rng, start)
    return replace(diagnosis, model=replace(diagnosis.model, fit=model.fit)), evidence


def are_likely(study: Study, causes: Sequence[str], values: Mapping[int, float]) -> bool:
    """Tell whether causes ended where use leads to."""
    for cause in causes:
        wear, column = SUSPECTS.get(cause), study.table.columns(cause)[0]
        if wear is not None:
            low = study.base_value(column) if wear.low is None else wear.low
            if not low <= values[column] <= wear.high:
                return False
    return True


def growth(now: Dataset, earlier: Dataset, model: Model) -> float:
    """Return by how much a model's error on what may be fitted of logs has grown [1]."""
    return model_error(now.train, model) / max(model_error(earlier.train, model), 1.0e-12)


def model_error(recordings: Sequence[Recording], model: Model) -> float:
    """Return a model's closed-loop error of the motor's angle over some recordings, RMS [rad]."""
    study = Study(recordings, model, tuple(effect.name for effect in model.effects))
    (errors,) = evaluate_models(study, [{}])
    return errors.pooled().theta_rmse


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A model whose numbers were fitted."""

    model: Model
    before: float  # Score with the numbers that it had [nat per row]: the less, the likelier
    after: float  # Score with those that were found


def tune(recordings: Sequence[Recording], model: Model) -> Tuned:
    """Fit the numbers of a model's effects, and those that it declares unknown.

    A fit that ends no better than the model leaves it as it is.

    Args:
        model: Numbers at the start of the fit.
    """
    names = tuple(effect.name for effect in model.effects)
    study = Study(recordings, model, names, time_step=SEARCH_STEP, in_segments=True)
    worlds = SearchWorlds(study)
    start = as_stated(worlds, model, names)
    found = fit_set(worlds, model, names)
    if found.score >= start.score:
        return Tuned(model=model, before=start.score, after=start.score)
    values = values_of(worlds, found.columns, found.place)
    effects = tuple(
        NamedValues(
            name=name,
            values={study.table.owners[c][1].name: values[c] for c in study.table.columns(name)},
        )
        for name in names
    )
    tuned = replace(study.with_fitted(model, values), effects=effects)
    return Tuned(model=tuned, before=start.score, after=found.score)
