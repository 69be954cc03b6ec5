"""Every set of at most three causes of a list: all are scored, and the best refitted.

What a search misses is seen beside it. The sets are scored by the search's own survey, around the
model without causes and then around the best set so far, and refitted by its own refit.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.decide.decision import at_bound
from tendon_newton.diagnosis.search.decide.extent import deciding
from tendon_newton.diagnosis.search.decide.find_causes import MOST_CAUSES, part_of
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits
from tendon_newton.diagnosis.search.rule import PRICE
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.diagnosis.search.small_sets import STEPS, fit_small_sets
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tendon_newton.identification.testable import testable_effects

LAWS = (
    "gain_error", "command_delay", "actuator_lag", "deadband", "speed_limit", "coulomb_friction",
    "viscous_friction", "stribeck_friction", "load_dependent_friction", "gear_load_friction",
    "tendon_slack", "tendon_compliance", "backlash", "position_offset", "load_cell_bias",
    "load_cell_gain", "load_cell_delay",
)  # fmt: skip
"""Causes of which all sets are looked at: a bench shows some fourteen of them."""
TRIED, HALFWAY = 5, 2
"""Sets that are refitted by two steps and by two more, for each one that is refitted to its end."""


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Recordings as a decision sees them."""

    pool: Pool  # Takes all fits
    testable: tuple[str, ...]  # Causes that these recordings can show
    start: Mapping[int, float]  # Numbers that are free without any cause, column -> value


def bench_of(recordings: Sequence[Recording], model: Model, names: Collection[str]) -> Bench:
    """Prepare what decides: its rows, its floors with some causes in the model, and its price."""
    study = Study(
        recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_segments=True, tolerant=True
    )
    chosen = deciding(recordings, whole=study.kinematic)
    worlds = SearchWorlds(part_of(study, chosen, model))
    floors = floors_of(worlds, tuple(names))
    return Bench(
        pool=Pool(worlds, floors, PRICE, MOST_CAUSES),
        testable=tuple(testable_effects(study)),
        start={c: study.base_value(c) for c in (*study.fit_columns(model), *worlds.built_columns)},
    )


def enumerate_sets(bench: Bench, laws: Sequence[str], best: int) -> None:
    """Score all sets of some laws, refit the best of them, and keep these in the bench's pool.

    Args:
        bench: Takes all fits.
        laws: Causes of the sets; those that the recordings cannot show are left out.
        best: Sets of each round that are refitted to their end.
    """
    pool = bench.pool
    pool.followed = (TRIED * best, HALFWAY * best, best)
    begun = start_fits(pool.worlds, [((), bench.start)], pool.floors)
    pool.add(refit(pool.worlds, begun, pool.floors, iterations=STEPS))
    fit_small_sets(pool, [name for name in laws if name in bench.testable])


def may_win(pool: Pool, fit: Fit) -> bool:
    """Tell whether no number of a set ended at the edge of its range: none is named there."""
    return not any(at_bound(pool, fit, name) for name in fit.names)
