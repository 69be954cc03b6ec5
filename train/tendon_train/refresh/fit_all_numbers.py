"""All numbers of a model fitted to a bench's own logs; nothing is added and nothing is named."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.fixed_set import as_stated, fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.identification.study import Study


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
