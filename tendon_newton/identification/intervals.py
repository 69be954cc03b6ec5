"""How well a fit knows its numbers."""

import numpy as np
from scipy.special import stdtrit

from tendon_newton.data.recording import Array, Indices
from tendon_newton.identification.linearisation import Linearisation, invertible
from tendon_newton.identification.objective import Layout, loss_curvatures

LEVEL = 0.95  # Probability that an interval holds the truth
WIDENING = 4.0
"""How many times wider intervals are than their scatter over blocks of time [1]: blocks are few,
alike, and share the model's error of form. On 28 benches of a second plant with a dozen small
imperfections, of which a model has five, 3 and 4 hold 87 and 89 % of the numbers of planted causes,
with what effects that are not named leave open; docs/lab/search.md."""
SHARED_FORM = 3.0
"""How many times wider scatter counts as evidence between sets of causes, and between days [1]: an
error of form acts on these as on a number."""
MOST_BY_RECORDING = 3.0
"""How many times wider than by blocks of time an interval may be by whole recordings [1]: two of
those know their own scatter so badly that Student's quantile alone widens it sixfold."""
LEAST_SHARE = 1.5e-2
"""Share of a value that the search's step, simplified sensors and the form of laws leave open,
whatever the noise: numbers of planted causes that are known best miss by 1 to 3 %."""


def half_widths(point: Linearisation, where: Layout, spread: Array, form: float = 1.0) -> Array:
    """Return half the 95 % intervals of a fit's numbers, given its model, shape (F,).

    Their scatter is that from block to block of time: rows inside a block may be correlated, and
    the noise need not be known. Whole recordings as blocks give a second estimate, which counts
    where it is wider, with at most `MOST_BY_RECORDING` times the first: a recording shares errors
    of form alone, and noise tells no more by recordings. That the model is right, and has the right
    causes, is taken for granted.

    Args:
        point: The fit around its optimum.
        where: Says which rows belong together.
        spread: Standard deviation of what states each number, in its coordinate; infinite where
            nothing does, shape (F,).
        form: Share of the residuals' squares that is no noise: it is what widens intervals [1].
    """
    if point.jacobian.shape[1] == 0:
        return np.zeros(0)
    together = rows_together(point, where)
    by_block = half_width(point, where.block, spread, together, widening(form))
    by_recording = half_width(point, where.recording, spread, together)
    most = 1.0 + (MOST_BY_RECORDING - 1.0) * form
    return np.maximum(by_block, np.minimum(by_recording, most * by_block))


def widening(form: float) -> float:
    """Return how many times wider than rows scatter a share of form [1] makes errors count [1]."""
    return 1.0 + (WIDENING - 1.0) * form


def rows_together(point: Linearisation, where: Layout) -> float:
    """Return how many rows tell as much as one alone would [1].

    Neighbouring rows err together: the numbers of a fit scatter more over blocks of time than
    rows that err alone would let them; this is the median ratio of the two variances, at least one.
    """
    if point.jacobian.shape[1] == 0:
        return 1.0
    inverse = np.linalg.inv(invertible(point.normal_matrix()))
    rows = [where.block == block for block in np.unique(where.block)]
    gradients = np.stack([point.gradient(row) for row in rows])
    gradients -= gradients.mean(axis=0)
    scattered = np.square(gradients @ inverse).sum(axis=0)
    return max(1.0, float(np.median(scattered / np.maximum(np.diag(inverse), 1.0e-300))))


def half_width(
    point: Linearisation, groups: Indices, spread: Array, together: float = 1.0, wider: float = 1.0
) -> Array:
    """Return half the spread of a fit's parameters over draws of groups of rows, shape (F,).

    Args:
        point: The fit around its optimum.
        groups: Which rows belong together, shape (M,).
        spread: As of `half_widths`.
        together: Rows that tell as much as one alone would [1].
        wider: How many times wider errors count than rows scatter [1].
    """
    return np.sqrt(np.diag(scatter(point, groups, spread, together, wider)))


def correlations(point: Linearisation, where: Layout, spread: Array, form: float) -> Array:
    """Return how the numbers of a fit err together [1], shape (F, F).

    Args:
        point: The fit around its optimum.
        where: Says which rows belong together.
        spread: As of `half_widths`, like the next.
        form: Share of the residuals' squares that is no noise [1].
    """
    together = rows_together(point, where)
    joint = scatter(point, where.block, spread, together, widening(form))
    size = np.sqrt(np.maximum(np.diag(joint), 1.0e-300))
    out = joint / np.outer(size, size)
    np.fill_diagonal(out, 1.0)
    return out


def scatter(
    point: Linearisation, groups: Indices, spread: Array, together: float, wider: float
) -> Array:
    """Return the covariance of half widths over draws of groups of rows, shape (F, F).

    It is the sandwich of the loss's curvature and the scatter of its slope from group to group.
    What states a number counts as one observation of it among those of the rows, of which
    `together` tell as much as one. Student's quantile stands in for the normal one, since the
    groups are few. A tolerance is what it is: it has no error of form, and its quantile is normal.

    Source: Huber, The behavior of maximum likelihood estimates under nonstandard conditions (1967);
    clustered as in Liang and Zeger, Longitudinal data analysis using generalized linear models
    (1986).
    """
    rows = [groups == group for group in np.unique(groups)]
    count = len(rows)
    if count < 2:
        return np.zeros((point.jacobian.shape[1],) * 2)
    gradients = np.stack([point.gradient(row) for row in rows])
    gradients -= gradients.mean(axis=0)  # of a fit that a bound holds, the sum is not zero
    bent = (point.weight * loss_curvatures(point.residual))[:, None] * point.jacobian
    stated = together / spread**2
    inverse = np.linalg.inv(invertible(point.jacobian.T @ bent + np.diag(stated)))
    student, normal = stdtrit((count - 1, np.inf), 0.5 * (1.0 + LEVEL))
    drawn = student * wider * np.sqrt(count / (count - 1)) * gradients.T
    errors = inverse @ np.hstack((drawn, np.diag(normal * np.sqrt(together * stated))))
    return errors @ errors.T
