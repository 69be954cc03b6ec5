"""All sets of at most three causes of a list: each is scored, and the best are refitted."""

from collections.abc import Iterator, Sequence
from itertools import combinations, product

from tendon_newton.diagnosis.search.choice import Chooser, Trial
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit
from tendon_newton.diagnosis.search.starts import new_starts
from tendon_newton.diagnosis.search.strategy import follow
from tendon_newton.diagnosis.search.survey import survey

SIZE = 3  # Causes of a set at most
ROUNDS = 2  # Places around which all sets are scored
LOOKED, STEPS = 16, 12
"""Sets that are simulated once for each one that is refitted to its end, and steps to that end."""


def fit_small_sets(pool: Pool, laws: Sequence[str]) -> list[Fit]:
    """Score all sets of some laws, refit the best of them, and keep these in a pool.

    They are scored around the model without causes, and then around the best of them.

    Args:
        pool: Has the fit without causes, and takes all others.
        laws: Causes of the sets.

    Returns:
        The sets that were refitted to their end, the best first.
    """
    around, found = pool.fits[frozenset()], list[Fit]()
    best = pool.followed[-1]
    for turn in range(ROUNDS):
        view = survey(pool.worlds, around, laws, pool.floors, coarse=not turn)
        chooser = Chooser(view, pool.price, SIZE)
        trials = sorted(all_sets(chooser, laws), key=chooser.cost)
        starts = new_starts(pool, view, trials[: LOOKED * best])
        found += follow(pool, view, starts, coarse=0 if turn else 2, last=STEPS)[:best]
        around = min([around, *found], key=pool.cost)
    keys = dict.fromkeys(frozenset(fit.names) for fit in found)
    return sorted((pool.fits[key] for key in keys if key in pool.fits), key=pool.cost)


def all_sets(chooser: Chooser, laws: Sequence[str]) -> Iterator[Trial]:
    """Yield each set of at most three laws, at the best of what the survey saw of each.

    No law stands beside its own special case.
    """
    held = chooser.survey.fit.names
    atoms: dict[str, list[int]] = {}
    for i in chooser.atoms.tolist():
        atoms.setdefault(chooser.survey.columns[i].name, []).append(i)
    known = [name for name in laws if name in atoms or name in held]
    for size in range(1, SIZE + 1):
        for names in combinations(known, size):
            if all(chooser.relatives[name].isdisjoint(names) for name in names):
                new = product(*(atoms[name] for name in names if name not in held))
                gone = [name for name in held if name not in names]
                yield min((chooser.solve(own, gone) for own in new), key=lambda t: t.score)
