"""Sets of causes are fitted jointly, many at once, each to its own optimum."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search import fixed_set, search_worlds
from tendon_newton.diagnosis.search.decide.decision import special_case_or_without
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew, with_effects
from tendon_newton.diagnosis.search.floors import floors_of, least_scales, usual_form
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import (
    LEAST_DAMPING,
    MOST_DAMPING,
    Fit,
    linearise,
    mean_loss,
    refit,
    rows_of,
    start_fits,
    surprise,
    values_of,
)
from tendon_newton.diagnosis.search.rule import PRICE
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.diagnosis.search.unseen_parts import folds, unseen_terms
from tendon_newton.identification.objective import group_sums
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.effect_bench import commanded, steps_and_waves
from tests.physics.runs import ideal_model

STEP = 1.0e-3  # [s]
CAUSES = ("viscous_friction", "gain_error")
CATALOGUE = (*CAUSES, "spool_radius_error", "joint_stiffness_error")
TRUTH = {"viscous_friction": 1.2, "gain_error": 0.85}
COUNT = 1.5e-3  # [rad]


def log(seed: int, **effects: dict[str, float]) -> Recording:
    """What a weak spring logs with some effects, and a sensor's noise."""
    rng = np.random.default_rng(seed)
    asked = replace(commanded((0.6 + 0.2 * seed) * steps_and_waves()), force=np.zeros((160, 1)))
    (out,) = replay([asked], ideal_model(**effects), time_step=STEP)
    found = simulated_recording(asked, out)
    noise = rng.normal(0.0, COUNT, found.motor_position.shape)
    return replace(found, name=f"log_{seed}", motor_position=found.motor_position + noise)


@pytest.fixture(scope="module")
def worlds() -> SearchWorlds:
    """Three logs of a servo with a weak gain and viscous friction."""
    effects = {
        "viscous_friction": {"coefficient": TRUTH["viscous_friction"]},
        "gain_error": {"scale": TRUTH["gain_error"]},
    }
    logs = [log(seed, **effects) for seed in range(3)]
    return SearchWorlds(Study(logs, ideal_model(), CAUSES, time_step=STEP))


def start(worlds: SearchWorlds, **values: float) -> Fit:
    """A set of causes at some values."""
    columns = {worlds.study.table.columns(name)[0]: v for name, v in values.items()}
    floors = floors_of(worlds, ())
    return start_fits(worlds, [(tuple(values), columns)], floors)[0]


def numbers(worlds: SearchWorlds, fit: Fit) -> dict[str, float]:
    """A fit's numbers by effect."""
    values = values_of(worlds, fit.columns, fit.place)
    return {name: values[worlds.study.table.columns(name)[0]] for name in fit.names}


def test_a_descent_has_the_slope_of_the_score(worlds: SearchWorlds) -> None:
    """Else it ends beside the place that a decision asks for.

    Rows at rest count less, and one log's cell was off, so that forces have fewer rows than angles.
    """
    logs = [log(0, coulomb_friction={"force": 0.6}), replace(log(1), force=None)]
    some = SearchWorlds(Study(logs, ideal_model(), CAUSES, time_step=STEP, tolerant=True))
    floors = replace(floors_of(some, ()), rest=0.1)
    (column,) = some.study.table.columns("viscous_friction")
    starts = [(("viscous_friction",), {column: value}) for value in (0.8, 0.8008)]
    here, there = start_fits(some, starts, floors)
    rows, together = rows_of(some, here, floors), some.rows_together(here.residual, floors)
    told = [mean_loss(some, fit, rows, together) for fit in (here, there)]
    change = len(some.where.signals) * (told[1] - told[0])
    assert change == pytest.approx(there.score - here.score, rel=0.02)


def test_each_set_finds_its_own_optimum(worlds: SearchWorlds) -> None:
    """Sets of different sizes side by side end where each ends alone; both causes at the truth."""
    starts = [
        start(worlds, viscous_friction=0.3),
        start(worlds, viscous_friction=0.3, gain_error=1.0),
    ]
    floors = floors_of(worlds, ())
    together = refit(worlds, starts, floors, iterations=10)
    alone = [refit(worlds, [fit], floors, iterations=10)[0] for fit in starts]
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_allclose(one.place, other.place, rtol=1e-6)
    assert numbers(worlds, together[1]) == pytest.approx(TRUTH, rel=0.01)
    assert together[1].score < together[0].score - 1.0


def test_every_second_step_borrows_its_derivatives(worlds: SearchWorlds) -> None:
    """Two numbers and three dampings: five simulations for a step, and three for the next."""
    fit = start(worlds, viscous_friction=0.3, gain_error=1.0)
    floors, counts = floors_of(worlds, ()), []
    for _ in range(4):
        before = worlds.count
        (fit,) = refit(worlds, [fit], floors, iterations=1)
        counts.append(worlds.count - before)
    assert counts == [5, 3, 5, 3]
    assert numbers(worlds, fit) == pytest.approx(TRUTH, rel=0.05)


def test_a_step_that_leads_nowhere_is_tried_shorter(worlds: SearchWorlds) -> None:
    """Derivatives of the wrong sign lead up: the factor grows to its limit before the fit ends."""
    fit = replace(start(worlds, viscous_friction=0.3, gain_error=1.0), damping=LEAST_DAMPING)
    floors = floors_of(worlds, ())
    (right,) = linearise(worlds, [fit])
    (after,) = refit(worlds, [fit], floors, iterations=9, jacobians=[-right], coarse=0)
    assert after.damping == MOST_DAMPING
    assert np.array_equal(after.place, fit.place)
    assert after.settled


def test_a_step_goes_to_the_end_of_a_valley(worlds: SearchWorlds) -> None:
    """A small spool and stiff springs nearly undo each other: what is stated of them decides."""
    own = SearchWorlds(
        Study(worlds.study.wholes, ideal_model(), CATALOGUE, time_step=STEP, tolerant=True)
    )
    begun = {**TRUTH, "spool_radius_error": 0.97, "joint_stiffness_error": 1.03}
    values = {own.study.table.columns(name)[0]: value for name, value in begun.items()}
    floors = floors_of(own, ())
    (fit,) = start_fits(own, [(CAUSES, values)], floors)
    assert surprise(own, fit) > 2.0
    (fit,) = refit(own, [fit], floors, iterations=1, coarse=0)
    assert surprise(own, fit) < 0.1


def test_a_step_that_gains_half_a_nat_is_not_the_last(worlds: SearchWorlds) -> None:
    """It is half a thousandth per row where laws miss nothing, and a name may cost as little."""
    floors = least_scales(worlds.study, usual_form(worlds.study), 0.0, 1.0)
    columns = [worlds.study.table.columns(n)[0] for n in CAUSES]
    (best,) = refit(worlds, [start(worlds, **TRUTH)], floors, iterations=12)
    rows = rows_of(worlds, best, floors)
    together = worlds.rows_together(best.residual, floors)
    least = mean_loss(worlds, best, rows, together)
    values = values_of(worlds, best.columns, best.place)
    for off in np.geomspace(1.0e-5, 0.1, 80):
        moved = {**values, columns[1]: (1.0 + off) * values[columns[1]]}
        (fit,) = start_fits(worlds, [(CAUSES, moved)], floors, near=True)
        if mean_loss(worlds, fit, rows, together) - least > 5.0e-4:
            break
    (after,) = refit(worlds, [fit], floors, iterations=1, coarse=0)
    assert after.score < fit.score < best.score + 2.0e-3
    assert not after.settled


def test_borrowed_derivatives_are_corrected_by_the_last_step(worlds: SearchWorlds) -> None:
    """Along it they say what it did to the residual; across it they are as they were."""
    floors = floors_of(worlds, ())
    fit = start(worlds, viscous_friction=0.3, gain_error=1.0)
    (old,) = linearise(worlds, [fit])
    (after,) = refit(worlds, [fit], floors, iterations=1)
    step = after.place - fit.place
    new = np.stack([after.slopes[c] for c in after.columns], axis=1)
    np.testing.assert_allclose(new @ step, after.residual - fit.residual, atol=1e-12)
    across = np.array([-step[1], step[0]])
    np.testing.assert_allclose(new @ across, old @ across, atol=1e-9)


def test_effects_are_added_from_their_typical_values(worlds: SearchWorlds) -> None:
    """No start is given: the truth is found to 1 %, whichever effect comes first."""
    for names in (CAUSES, CAUSES[::-1]):
        found = fit_set_anew(worlds, ideal_model(), names)
        assert numbers(worlds, found) == pytest.approx(TRUTH, rel=0.01)


def test_a_set_fits_no_worse_than_what_it_contains(worlds, monkeypatch) -> None:
    """Where typical values lead astray, here to a servo that nothing moves."""
    floors, less = floors_of(worlds, CAUSES), fit_set_anew(worlds, ideal_model(), CAUSES[:1])
    (gain,) = worlds.study.table.columns("gain_error")
    monkeypatch.setattr(fixed_set, "atoms", lambda *_: [{gain: 1.0e-3}])
    for steps in ("FIRST_STEPS", "LAST_STEPS"):
        monkeypatch.setattr(fixed_set, steps, 0)
    found = with_effects(worlds, less, ["gain_error"], floors)
    assert found.score == pytest.approx(less.score)


def test_a_fit_stays_in_bounds(worlds: SearchWorlds) -> None:
    """Friction below none is not friction: data with less of it than the model end at none."""
    clean = SearchWorlds(Study([log(1)], ideal_model(), CAUSES, time_step=STEP))
    found = refit(clean, [start(clean, viscous_friction=0.5)], floors_of(clean, ()), iterations=10)
    assert 0.0 <= numbers(clean, found[0])["viscous_friction"] < 0.01


def test_what_a_refused_cause_leaves_is_at_its_optimum(worlds: SearchWorlds) -> None:
    """A set that was clearly worse, and so never followed, is followed before it stands alone."""
    floors = floors_of(worlds, ())
    pool = Pool(worlds=worlds, floors=floors, dearest=PRICE, most=3)
    pool.add([start(worlds, viscous_friction=0.05)])
    far = replace(start(worlds, viscous_friction=9.0, gain_error=0.5), score=-100.0)
    pool.add([far])
    left = special_case_or_without(pool, far, "gain_error")
    (best,) = refit(worlds, [start(worlds, viscous_friction=0.3)], floors, iterations=10)
    assert left.names == ("viscous_friction",)
    assert numbers(worlds, left) == pytest.approx(numbers(worlds, best), rel=0.02)


def test_turns_are_those_of_one_simulation(worlds, monkeypatch) -> None:
    """One candidate after the other, to the bit; a pool keeps nothing that stood beside a fit."""
    models = [{}, *({c: 0.5} for c in start(worlds, viscous_friction=1.0, gain_error=1.0).columns)]
    together = worlds.residuals(models)
    monkeypatch.setattr(search_worlds, "MOST_NUMBERS", 1)
    np.testing.assert_array_equal(worlds.residuals(models), together)
    pool = Pool(worlds=worlds, floors=floors_of(worlds, ()), dearest=PRICE, most=3)
    pool.add([start(worlds, viscous_friction=1.0)])
    assert all(fit.residual.base is None for fit in pool.fits.values())


def test_a_few_wild_rows_do_not_decide(worlds: SearchWorlds) -> None:
    """Readings that are off by a radian in 2 % of the rows move the numbers by less than 2 %."""
    spoiled = []
    for recording in worlds.study.recordings:
        position = recording.motor_position.copy()
        position[25::50] += 1.0
        spoiled.append(replace(recording, motor_position=position))
    other = SearchWorlds(Study(spoiled, ideal_model(), CAUSES, time_step=STEP))
    fit = start(other, viscous_friction=0.5, gain_error=1.0)
    (found,) = refit(other, [fit], floors_of(worlds, ()), iterations=12)
    assert numbers(other, found) == pytest.approx(TRUTH, rel=0.02)


def test_what_a_part_holds_does_not_move_its_own_refit(worlds: SearchWorlds) -> None:
    """Another log in place of the first: the refit that does not see it is the same to the bit."""
    other = log(0, viscous_friction={"coefficient": 3.0})
    changed = SearchWorlds(
        Study([other, *worlds.study.recordings[1:]], ideal_model(), CAUSES, time_step=STEP)
    )
    floors, rows = floors_of(worlds, ()), folds(worlds) != 0
    place = {"viscous_friction": 1.0, "gain_error": 0.9}
    found = [
        refit(w, [start(w, **place)], floors, iterations=3, rows=rows)[0] for w in (worlds, changed)
    ]
    np.testing.assert_array_equal(found[0].place, found[1].place)
    seen = refit(changed, [start(changed, **place)], floors, iterations=3)[0]
    assert not np.allclose(seen.place, found[1].place, rtol=1e-2)


def test_a_cause_pays_on_left_out_parts_that_have_it_and_costs_on_others(worlds) -> None:
    """Two recordings of three have friction: left out, each gains by it, and the third loses."""
    friction = {"viscous_friction": {"coefficient": 1.2}}
    logs = [log(0, **friction), log(1, **friction), log(2)]
    mixed = SearchWorlds(Study(logs, ideal_model(), CAUSES, time_step=STEP))
    floors = floors_of(mixed, ())
    (found,) = refit(mixed, [start(mixed, viscous_friction=1.0)], floors, iterations=8)
    without, own = (unseen_terms(mixed, f, floors) for f in (start(mixed), found))
    gains = group_sums(without - own, mixed.where.recording)
    assert gains[0] > 0.0
    assert gains[1] > 0.0
    assert gains[2] < 0.0


def test_a_switch_is_found_that_no_slope_leads_to() -> None:
    """A servo cuts its force after 110 ms; a fit that begins at 180 ms finds that within 1 %."""
    truth = {"duty": 0.15, "fraction": 0.05, "time": 0.11}
    worlds = SearchWorlds(
        Study([log(0, overload_cut=truth)], ideal_model(), ("overload_cut",), time_step=STEP)
    )
    columns, floors = worlds.study.table.columns("overload_cut"), floors_of(worlds, ())
    begun = start_fits(
        worlds, [(("overload_cut",), dict(zip(columns, (0.15, 0.05, 0.18), strict=True)))], floors
    )
    (fit,) = refit(worlds, begun, floors, iterations=4)
    found = values_of(worlds, fit.columns, fit.place)
    assert found[columns[2]] == pytest.approx(truth["time"], rel=0.01)
