"""What effects that are not named do to the numbers of those that are."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of
from tendon_newton.effects import are_related
from tendon_newton.identification.intervals import rows_together
from tendon_newton.identification.linearisation import Linearisation, invertible
from tendon_newton.identification.objective import loss_weights


def moved_by_unnamed(
    pool: Pool,
    fit: Fit,
    point: Linearisation,
    unit: Array,
    names: Sequence[str],
    classes: Mapping[str, Collection[str]],
) -> Array:
    """Return half the 95 % intervals that effects too small to be named leave open, shape (F,).

    An effect that would bring less than its price is not named, and may be there. All numbers of
    the fit move a little to stand for it: by what the residuals along its direction project on
    theirs. Each effect counts by itself, at the size at which it would bring its price, and at most
    at that at which a survey begins.

    Source: bias by omitted variables (Greene, Econometric analysis, 4.3.2), each of which has the
    size that a test would just not have told.

    Args:
        pool: Has the prices.
        fit: The set.
        point: The fit around its optimum.
        unit: What its residuals are measured in, shape (M,).
        names: Effects that may be there.
        classes: Effects that may stand in the place of a named one: its numbers mean something only
            where it is there, and not one of them.
    """
    worlds = pool.worlds
    owners = [worlds.study.table.owners[c][0] for c in fit.columns]
    others = [n for n in names
              if n not in owners and not any(are_related(n, own) for own in fit.names)]  # fmt: skip
    if not others:
        return np.zeros(len(owners))
    values = values_of(worlds, fit.columns, fit.place)
    found = worlds.residuals([{**values, **atoms(worlds.study, name)[0]} for name in others])
    changes = ((found - fit.residual) / unit).T
    weight = point.weight * loss_weights(point.residual)
    stated = rows_together(point, worlds.where) / worlds.spreads(fit.columns, fit.names) ** 2
    shared = point.jacobian.T @ (weight[:, None] * changes)
    moves = np.linalg.solve(invertible(point.normal_matrix() + np.diag(stated)), shared)
    left = changes - point.jacobian @ moves
    asked = np.array([pool.bar(name) for name in others]) * len(weight) / len(worlds.where.signals)
    told = np.sum(weight[:, None] * left**2, axis=0) / (2.0 * asked)
    size = 1.0 / np.sqrt(np.maximum(told, 1.0))
    counts = [[name not in classes.get(owner, ()) for name in others] for owner in owners]
    return np.linalg.norm(counts * size * moves, axis=1)
