"""All numbers of a model fitted to a bench's own logs; nothing is added and nothing is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import SEARCH_STEP, values_of
from tendon_newton.diagnosis.search import Search
from tendon_newton.identification.least_squares import evaluate
from tendon_newton.identification.objective import loss_terms
from tendon_newton.identification.study import Study


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A model whose numbers were fitted."""

    model: Model
    before: float
    """Loss with the numbers that it had, summed over all rows [1]."""
    after: float
    """Loss with those that were found, at the same scales [1]."""


def tune(recordings: Sequence[Recording], model: Model) -> Tuned:
    """Fit the numbers of a model's effects, and those that it declares unknown.

    The search begins anew around each number, since the valleys of friction are narrow. A fit that
    ends no better than the model leaves it as it is.

    Args:
        recordings: What they are fitted to.
        model: Numbers at the start of the fit.
    """
    names = tuple(effect.name for effect in model.effects)
    study = Study(recordings, model, names, time_step=SEARCH_STEP, in_pieces=True)
    search = Search(study, model)
    candidate, _ = search.problem(names, None)
    scales = search.gap_scales(candidate)
    before = float(
        loss_terms(evaluate(search.simulate_at(scales), [candidate], [candidate.value])).sum()
    )
    (candidate,), _ = search.descend([candidate], [len(candidate.columns)], scales)
    after = float(
        loss_terms(evaluate(search.simulate_at(scales), [candidate], [candidate.value])).sum()
    )
    if after >= before:
        return Tuned(model=model, before=before, after=before)
    values = values_of(candidate)
    effects = tuple(
        NamedValues(
            name=name,
            values={study.table.owners[c][1].name: values[c] for c in study.table.columns(name)},
        )
        for name in names
    )
    tuned = replace(study.with_fitted(model, values), effects=effects)
    return Tuned(model=tuned, before=before, after=after)
