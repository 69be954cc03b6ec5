"""All numbers of a model fitted to a bench's own logs; nothing is added and nothing is named."""

from collections.abc import Sequence
from dataclasses import dataclass

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import extended_model
from tendon_newton.diagnosis.search.fixed_set import as_stated, fit_set
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.identification.study import Study


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A model whose numbers were fitted."""

    model: Model
    before: float
    """Score with the numbers that it had [nat per row]: the less, the likelier."""
    after: float
    """Score with those that were found."""


def tune(
    recordings: Sequence[Recording], model: Model, effects: Sequence[str] | None = None
) -> Tuned:
    """Fit the numbers of a model's effects, and those that it declares unknown.

    A fit that ends no better than the model leaves it as it is.

    Args:
        recordings: What they are fitted to.
        model: Numbers at the start of the fit.
        effects: Effects that the kernels hold; the model's own by default.
    """
    names = tuple(effect.cause for effect in model.effects)
    held = names if effects is None else effects
    study = Study(recordings, model, held, time_step=SEARCH_STEP, in_pieces=True)
    worlds = SearchWorlds(study)
    start = as_stated(worlds, model, names)
    found = fit_set(worlds, model, names)
    if found.score >= start.score:
        return Tuned(model=model, before=start.score, after=start.score)
    values = values_of(worlds, found.columns, found.place)
    tuned = extended_model(study, model, values, names)
    return Tuned(model=tuned, before=start.score, after=found.score)
