"""Sets of causes are compared at their best, judged where they act, and do not grow for ever."""

import math
import re
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.actuators import ACTUATORS
from tendon_newton.data.parameters import ON_A_SHAFT, TIME_POWERS, BenchScale
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import conclude
from tendon_newton.diagnosis.findings import Findings
from tendon_newton.diagnosis.result import Criterion
from tendon_newton.diagnosis.search import prune as pruning
from tendon_newton.diagnosis.search import strategy
from tendon_newton.diagnosis.search.choice import Chooser, choose, exchanges
from tendon_newton.diagnosis.search.decide import decision, told
from tendon_newton.diagnosis.search.decide.account import OPEN, REMAINS, criteria_of
from tendon_newton.diagnosis.search.decide.decision import (
    Decided,
    Refusal,
    asks_plain_models,
    best_predictor,
    best_without,
    decide,
    fit_replacements,
    fit_special_cases,
    followed,
    followed_to_end,
    held_out_gains,
    is_nothing,
    leaves_nothing_at_any_step,
    look_further,
    new_name,
    rivals_of,
    room,
    searched_further,
    special_case_left_open,
    special_case_or_without,
    with_predictor,
)
from tendon_newton.diagnosis.search.decide.fitted_sets import (
    between,
    found_of,
    harmonic,
    holds_null,
    posterior_of,
    probability,
    weights_of,
)
from tendon_newton.diagnosis.search.decide.told import (
    gains_of,
    taking_over,
    with_deserved,
    with_other_forces,
    with_told,
    within_ranges,
)
from tendon_newton.diagnosis.search.decide.unnamed import with_unnamed
from tendon_newton.diagnosis.search.floors import floors_of, form_of, least_scales, usual_form
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.prune import CLEAR, leave_out, settle
from tendon_newton.diagnosis.search.refit import (
    Fit,
    refit,
    start_fits,
    surprise,
    values_of,
    without,
)
from tendon_newton.diagnosis.search.rule import FORM_THETA, LADDER, NATS, SEARCHED
from tendon_newton.diagnosis.search.search_worlds import (
    INDEPENDENT,
    SEARCH_STEP,
    Floors,
    SearchWorlds,
    rests,
)
from tendon_newton.diagnosis.search.starts import new_starts, related_starts, similar_starts
from tendon_newton.diagnosis.search.strategy import singles_from_stated
from tendon_newton.diagnosis.search.survey import Column, Survey, survey
from tendon_newton.diagnosis.search.unseen_parts import folds, unseen_terms, untold
from tendon_newton.effects import EFFECTS, are_related
from tendon_newton.errors import UnknownName
from tendon_newton.identification import testable
from tendon_newton.identification.intervals import rows_together
from tendon_newton.identification.linearisation import Linearisation
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import BLOCK
from tendon_newton.identification.study import Study
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.effect_bench import commanded, steps_and_waves
from tests.physics.runs import ideal_model

STEP = 1.0e-3  # [s]
PRICE = 0.1  # [nat per row]
CATALOGUE = ("coulomb_friction", "viscous_friction", "stribeck_friction")
TRUTH = {"coulomb_friction": {"force": 0.6}, "viscous_friction": {"coefficient": 1.2}}
FLOORS = Floors(theta=1.0, force=1.0)


def log(seed: int, **causes: dict[str, float]) -> Recording:
    """What a weak spring logs with some causes, two frictions by default, and encoder noise."""
    rng = np.random.default_rng(seed)
    asked = replace(commanded((0.6 + 0.2 * seed) * steps_and_waves()), force=np.zeros((160, 1)))
    (out,) = replay([asked], ideal_model(**(causes or TRUTH)), time_step=STEP)
    found = simulated_recording(asked, out)
    noise = rng.normal(0.0, 5.0e-4, found.motor_position.shape)
    return replace(found, name=f"log_{seed}", motor_position=found.motor_position + noise)


@pytest.fixture(scope="module")
def worlds() -> SearchWorlds:
    """Three such logs."""
    return SearchWorlds(Study([log(n) for n in range(3)], ideal_model(), CATALOGUE, time_step=STEP))


def pool_of(worlds: SearchWorlds) -> Pool:
    """An empty pool whose floors are those of dry friction."""
    floors = floors_of(worlds, ("coulomb_friction",))
    return Pool(worlds=worlds, floors=floors, dearest=PRICE, most=7)


def started(pool: Pool, **values: float) -> Any:
    """A set of causes with the first number of each at some value."""
    columns = {pool.worlds.study.table.columns(name)[0]: v for name, v in values.items()}
    return start_fits(pool.worlds, [(tuple(values), columns)], pool.floors)[0]


def orthogonal(names: tuple[str, ...], inside: int) -> Survey:
    """A survey in which every cause explains a part of its own: the first ones are in the fit."""
    kinds = ["removal"] * inside + ["atom"] * (len(names) - inside)
    columns = tuple(
        Column(name=name, kind=kind, values={}, low=0.15, high=2.0)
        for name, kind in zip(names, kinds, strict=True)
    )
    gram = np.diag(np.full(len(names), 100.0))
    slope = np.where(np.array(kinds) == "atom", -100.0, 0.0)
    square = 100.0 * (len(names) - inside) + 1.0
    fit: Any = SimpleNamespace(names=names[:inside], columns=())
    return Survey(
        fit=fit, columns=columns, gram=np.stack([gram, 0.0 * gram]),
        slope=np.stack([slope, 0.0 * slope]), square=np.array([square, 0.0]),
        rows=np.array([10.0, 0.0]), floors=np.array([FLOORS.theta, FLOORS.force]),
        directions=np.zeros((len(names), 1)),
    )  # fmt: skip


@pytest.mark.parametrize("inside", [0, 3, 4])
def test_no_set_grows_beyond_the_limit(inside: int) -> None:
    """Ten causes each explain a tenth: sets of four are chosen, forced rivals and all."""
    plain = tuple(n for n, e in EFFECTS.items() if len(e.parameters) == 1 and not e.includes)
    chooser = Chooser(orthogonal(plain[:10], inside), price=0.001, most=4)
    found = choose(chooser, 20) + (exchanges(chooser, 3) if inside else [])
    sizes = [len(chooser.names(trial)) for trial in found]
    assert max(sizes) == 4
    rivals = {name for trial in found for name in chooser.names(trial)}
    assert len(rivals) > 4


def residuals(acting: float, size: float) -> tuple[Any, Any, Any]:
    """A stand-in for the worlds of 1,000 rows, and fits with and without what acts in a share."""
    rng = np.random.default_rng(0)
    calm = 0.3 * rng.standard_normal(1000)
    moved = calm + np.where(np.arange(1000) < 1000 * acting, size, 0.0)
    angle = np.ones(1000, dtype=bool)
    where = SimpleNamespace(
        sizes=lambda scales: np.full(1000, scales.theta), signals=(("theta", angle),)
    )
    study = SimpleNamespace(
        known=("coulomb_friction",), scale=BenchScale(turn=1.0 / (SEARCHED * FORM_THETA)),
        noise=NoiseFloor(theta=0.0, force=None), table=SimpleNamespace(columns=lambda _: (0,)),
        is_led=False, form=lambda usual: usual,
    )  # fmt: skip
    rows: Any = SimpleNamespace(
        where=where, weights=lambda _: np.ones(1000), study=study, rows_alone=lambda *_: 100.0,
        stated=frozenset(), spreads=lambda *_: np.zeros(0),
    )  # fmt: skip
    rows.score = partial(SearchWorlds.score, rows)
    score = [float(np.mean(4.5 * np.log1p(r**2 / 9.0))) for r in (calm, moved)]
    scales = np.array([1.0])
    fits = [
        Fit(names=("speed_limit",), columns=(), place=np.zeros(0), residual=r, score=s,
            scales=scales, stride=np.zeros(0))
        for r, s in zip((calm, moved), score, strict=True)
    ]  # fmt: skip
    return rows, fits[0], fits[1]


def test_a_cause_that_acts_at_times_is_seen_and_judged_where_it_acts() -> None:
    """A twentieth of the rows is off by thirty floors; the likely scale of all is the floor."""
    rows, fit, less = residuals(0.05, 30.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=PRICE, most=7)
    assert pool.excess(fit) < PRICE < pool.excess(less)
    assert pool.worth(fit, less, "speed_limit") > 1.0


def test_what_acts_in_few_rows_is_left_even_where_something_sticks() -> None:
    """A hundredth of the rows is off by twenty floors: the score hides it, the mean does not."""
    rows, fit, less = residuals(0.01, 20.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=PRICE, most=7)
    assert pool.leaves_nothing(fit, anywhere=True)
    assert pool.leaves_nothing(less)
    assert not pool.leaves_nothing(less, anywhere=True)


def test_noise_that_is_known_to_a_thirtieth_is_no_excess() -> None:
    """A thousand rows tell a noise to 3 %: a fifth more of it is what something else left."""
    rows, fit, _ = residuals(0.0, 0.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=PRICE, most=7)
    noise = fit.residual / np.std(fit.residual)
    few, much = (
        pool.mean_excess(replace(fit, residual=share * noise), FLOORS, 1.0) for share in (1.03, 1.2)
    )
    assert few == 0.0 < much


def test_a_verdict_grants_the_mean_all_that_laws_usually_miss() -> None:
    """A hundredth of the rows is off by twelve usual errors: too much for a search alone."""
    rows, _, less = residuals(0.01, 36.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=PRICE, most=7)
    assert pool.leaves_nothing(less, anywhere=True, usual=True)
    assert not pool.leaves_nothing(less, anywhere=True)


def test_a_cause_pays_though_less_than_the_error_of_form_is_left_without_it(monkeypatch) -> None:
    """A tenth of the rows is off by four floors: less than a price, and yet a cause brings it."""
    rows, fit, less = residuals(0.1, 4.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=PRICE, most=7)
    assert pool.leaves_nothing(less)
    monkeypatch.setattr(pruning, "leave_out", lambda *_: {"speed_limit": less})
    assert pruning.prune(pool, fit) is fit


def test_causes_begin_from_what_is_stated_where_stated_numbers_gave_way(monkeypatch) -> None:
    """A spool and springs at the ends of their tolerances hide a spring that stiffens."""
    logs = [log(seed, spring_stiffening={"beta": 0.3}) for seed in range(2)]
    names = ("spring_stiffening", "spool_radius_error", "joint_stiffness_error")
    own = SearchWorlds(Study(logs, ideal_model(), names, time_step=SEARCH_STEP, tolerant=True))
    spool, springs = (own.study.table.columns(name)[0] for name in names[1:])
    pool = Pool(worlds=own, floors=floors_of(own, ()), dearest=PRICE, most=7)
    off, stated = start_fits(own, [((), {spool: 0.971, springs: 1.08}), ((), {})], pool.floors)
    found = singles_from_stated(pool, off, names)[0]
    assert found.names == ("spring_stiffening",)
    assert surprise(own, found) < 0.1
    called = list[Fit]()
    monkeypatch.setattr(Pool, "leaves_nothing", lambda *_, **__: False)
    monkeypatch.setattr(
        strategy, "singles_from_stated", lambda _, fit, __: called.append(fit) or []
    )
    for fit in (stated, off):
        strategy.add_sets(pool, fit, names, first=True)
    assert called == [off]


def hitting_stops() -> SearchWorlds:
    """Worlds of a finger that hits its stops, which no cause explains."""
    asked = commanded(np.repeat([0.2, 6.0, 0.2, 5.0, 0.2], 40), bench="finger")
    asked = replace(asked, force=np.zeros((200, 1)))
    (out,) = replay([asked], ideal_model(), time_step=1.0e-4)
    found = simulated_recording(asked, out)
    noise = np.random.default_rng(0).normal(0.0, 5.0e-4, found.motor_position.shape)
    found = replace(found, motor_position=found.motor_position + noise)
    return SearchWorlds(Study([found], ideal_model(), CATALOGUE, time_step=SEARCH_STEP))


def test_a_long_step_at_a_stop_is_no_gap() -> None:
    """A finger that hits its stops is off in some rows at the search's step alone."""
    own = hitting_stops()
    pool = Pool(worlds=own, floors=floors_of(own, ()), dearest=PRICE, most=7)
    (fit,) = start_fits(own, [((), {})], pool.floors)
    assert not pool.leaves_nothing(fit)
    assert leaves_nothing_at_any_step(pool, fit)


def test_rows_that_a_long_step_misses_hardly_count() -> None:
    """Else the search's step decides which set is better, and not the causes."""
    own = hitting_stops()
    floors = floors_of(own, ())
    both = np.stack([own.residuals([{}])[0], own.finest({})])
    (before,) = np.diff(own.score(both, floors).value)
    assert own.look_finer({}, floors)
    assert not own.look_finer({}, floors)
    (after,) = np.diff(own.score(both, floors).value)
    assert before < -0.1
    assert abs(after) < 0.2 * abs(before)
    assert np.median(own.weights(floors)) > 0.9


def test_a_pool_scores_sets_anew_where_the_step_cannot_be_trusted() -> None:
    """A set that was fitted before is not judged by other rows than those that come after."""
    own = hitting_stops()
    pool = Pool(worlds=own, floors=floors_of(own, ()), dearest=PRICE, most=7)
    pool.add(start_fits(own, [((), {})], pool.floors))
    before = pool.best()
    pool.unseen[frozenset(), before.score] = np.zeros(1)
    after = pool.renew(before)
    assert np.median(own.step_error) < pool.floors.theta < own.step_error.max()
    assert after.score < before.score - 0.1
    assert not pool.unseen


@pytest.mark.parametrize(("size", "is_cause"), [(0.4, False), (0.9, True)])
def test_a_change_below_the_error_of_form_is_no_cause(size: float, is_cause: bool) -> None:
    """Less than half of what a search tells apart is no cause in all rows, however likely."""
    rows, fit, less = residuals(1.0, size)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=0.01, most=7)
    assert (pool.worth(fit, less, "speed_limit") >= 1.0) is is_cause


def test_only_where_something_sticks_is_a_law_that_sticks_expected_to_miss(worlds) -> None:
    """A third of its error of form is enough to name the first dry friction, not the second."""
    plain, dry = form_of(worlds, ("viscous_friction",)), form_of(worlds, ("coulomb_friction",))
    assert dry.theta == pytest.approx(SEARCHED * FORM_THETA * worlds.study.scale.turn)
    assert (plain.theta, plain.force) == pytest.approx((dry.theta / LADDER, dry.force / LADDER))
    assert form_of(worlds, ("tendon_slack",)) == dry  # it leaves out what damps the string


def parts(*benches: str, gains: Sequence[float] = ()) -> list[set[int]]:
    """Return the parts that the rows of each recording belong to, 60 blocks a recording."""
    recordings = [replace(log(0), bench=bench) for bench in benches]
    for i, gain in enumerate(gains):
        recordings[i] = replace(recordings[i], actuator_overrides={"duty_per_rad": gain})
    rows = np.arange(60 * len(benches))
    where = SimpleNamespace(recording=rows // 60, block=rows)
    stand_in: Any = SimpleNamespace(study=SimpleNamespace(wholes=recordings), where=where)
    part = folds(stand_in)
    return [set(part[rows // 60 == i].tolist()) for i in range(len(benches))]


def test_recordings_are_left_out_whole_but_never_all_of_a_bench() -> None:
    """Numbers of a bench are not guessed from other benches; two recordings are cut in time."""
    assert parts("finger", "finger", "finger") == [{0}, {1}, {2}]
    assert parts("finger", "finger") == [{0, 1, 2, 3, 4}] * 2
    whole = parts("finger", "spring_weak", "finger", "finger", "finger", "finger", "spring_strong")
    assert [part for part in whole if len(part) > 1] == [{0, 1, 2, 3, 4}] * 2
    assert sorted(min(part) for part in whole if len(part) == 1) == [0, 1, 2, 3, 4]
    assert set.intersection(*parts("spring_weak", "spring_weak", "finger", "finger")) == set()


def test_two_conditions_are_left_out_whole() -> None:
    """What holds at one gain of a servo is asked of the other, not of logs at both."""
    pendulums = ["pendulum"] * 4
    assert parts(*pendulums, gains=(0.6, 2.3, 0.6, 2.3)) == [{0}, {1}, {0}, {1}]
    assert parts(*pendulums, gains=(0.6, 0.6, 0.6, 0.6)) == [{0}, {1}, {2}, {3}]
    assert parts("pendulum", "pendulum", gains=(0.6, 2.3)) == [{0, 1, 2, 3, 4}] * 2


def test_settling_ends_where_the_best_set_is_pruned_to_the_one_before(monkeypatch) -> None:
    """A set may cost least and yet hold a cause that changes too little to be named."""
    one: Any = SimpleNamespace(names=("viscous_friction",))
    more: Any = SimpleNamespace(names=("viscous_friction", "coulomb_friction"))
    pruned: list[Any] = []

    def prune_to_one(_pool: Any, fit: Any) -> Any:
        pruned.append(fit)
        assert len(pruned) <= 2
        return one

    monkeypatch.setattr(pruning, "prune", prune_to_one)
    monkeypatch.setattr(pruning, "exchange", lambda *_: None)
    monkeypatch.setattr(pruning, "simplest", lambda *_: more)
    pool: Any = SimpleNamespace(
        worlds=SimpleNamespace(count=0), is_late=False, best=lambda: more, price=PRICE,
        cost=lambda fit: float(len(fit.names)), log=lambda *_: None,
        renew=lambda fit: fit,
    )  # fmt: skip

    assert settle(pool, more, CATALOGUE) is one
    assert pruned == [more, more]


def test_a_refused_cause_takes_no_others_with_it(worlds: SearchWorlds) -> None:
    """Without it the rest explains less than another set that was fitted: that one is next."""
    pool = pool_of(worlds)
    law, plain = worlds.study.table.columns("stribeck_friction"), {"viscous_friction": 1.2}
    values = dict(zip(law, (0.6, 0.6, 1.0), strict=True))
    (viscous,) = worlds.study.table.columns("viscous_friction")
    names = ("stribeck_friction", "viscous_friction")
    pool.add(start_fits(worlds, [(names, {**values, viscous: 1.2})], pool.floors))
    pool.add([started(pool, coulomb_friction=0.6, **plain)])
    rest = started(pool, **plain)
    assert set(best_without(pool, rest, {"coulomb_friction"}).names) == set(names)
    assert best_without(pool, rest, {"coulomb_friction", names[0]}).names == ("viscous_friction",)


def test_a_fit_that_did_not_settle_goes_on(worlds: SearchWorlds) -> None:
    """A set that was left half way is a start again, where it stood; one at its end is none."""
    pool = pool_of(worlds)
    pool.add([started(pool, viscous_friction=1.0)])
    (half,) = refit(worlds, [started(pool, viscous_friction=1.0, coulomb_friction=0.1)],
                    pool.floors, iterations=1)  # fmt: skip
    assert not half.settled
    pool.add([half])
    view = survey(
        worlds, pool.fits[frozenset({"viscous_friction"})], CATALOGUE, pool.floors, coarse=True
    )
    chooser = Chooser(view, PRICE, 7)
    trials = [t for t in chooser.singles(5) if "coulomb_friction" in chooser.names(t)]
    ((names, values),) = new_starts(pool, view, trials)
    assert frozenset(names) == frozenset(half.names)
    assert values == values_of(worlds, half.columns, half.place)
    (whole,) = refit(worlds, [half], pool.floors, iterations=30)
    assert whole.settled
    pool.add([whole])
    assert new_starts(pool, view, trials) == []


def test_a_law_starts_where_it_is_its_special_case(worlds: SearchWorlds) -> None:
    """Stribeck's law starts as the Coulomb friction that was found, at each typical speed."""
    pool = pool_of(worlds)
    (fit,) = refit(worlds, [started(pool, coulomb_friction=0.5)], pool.floors, iterations=8)
    starts = related_starts(pool, fit, CATALOGUE)
    assert {names for names, _ in starts} == {("stribeck_friction",)}
    assert len(starts) == 9  # and at twice and half of that force
    laws = sorted(start_fits(worlds, starts, pool.floors), key=lambda law: law.score)
    assert [law.score for law in laws[:3]] == pytest.approx([fit.score] * 3, abs=1e-9)
    pool.add([replace(laws[0], score=fit.score - 1.0)])
    assert related_starts(pool, fit, CATALOGUE) == []


def test_a_special_case_starts_where_its_law_was_found(worlds: SearchWorlds) -> None:
    """Coulomb friction starts at the sliding force of Stribeck's law."""
    pool = pool_of(worlds)
    law = started(pool, stribeck_friction=0.5)
    starts = related_starts(pool, law, CATALOGUE)
    assert {names for names, _ in starts} == {("coulomb_friction",)}
    (column,) = worlds.study.table.columns("coulomb_friction")
    assert [values[column] for _, values in starts] == pytest.approx([0.5, 1.0, 0.25])


def test_no_limit_is_looked_for_beyond_its_range() -> None:
    """There it is met within a step, and is a delay of half of that; at its end it is nothing."""
    names = ("command_rate_limit", "acceleration_limit")
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    rate, slope, speed = (c for n in names for c in pool.worlds.study.table.columns(n))
    ends = {c: pool.worlds.coordinate(c).value(pool.worlds.coordinate(c).lower)
            for c in (rate, slope, speed)}  # fmt: skip
    assert ends == {rate: 100.0, slope: 1000.0, speed: math.inf}
    quick, quicker, none = (started(pool, command_rate_limit=x) for x in (8.0, 99.0, 100.0))
    assert is_nothing(pool, none, "command_rate_limit")
    assert not is_nothing(pool, quicker, "command_rate_limit")
    assert between(pool.worlds, quick, rate, [(quicker, 1.0)]) > 0.0
    assert between(pool.worlds, quick, rate, [(quick, 0.5), (none, 0.5)]) == 0.0
    assert between(pool.worlds, quick, rate, [(quicker, 0.0)]) == 0.0, "far behind: no weight"


def test_a_profile_with_a_slope_starts_as_one_without() -> None:
    """A typical slope is ten times too flat for a quick servo: such a start is never followed."""
    names = ("command_rate_limit", "acceleration_limit")
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, command_rate_limit=8.0)
    starts = related_starts(pool, fit, names)
    slope, speed = pool.worlds.study.table.columns("acceleration_limit")
    assert {values[slope] for _, values in starts} == {pool.worlds.study.parameter(slope).upper}
    assert {values[speed] for _, values in starts} == {8.0, 16.0, 4.0}


def test_what_is_easily_confused_is_tried(worlds: SearchWorlds) -> None:
    """A lag starts at the time of the delay that it is easily taken for."""
    names = ("command_delay", "actuator_lag", "coulomb_friction", "stribeck_friction", "hysteresis")
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, command_delay=0.03, coulomb_friction=0.5)
    plain = {frozenset(n) for n, _ in related_starts(pool, fit, names)}
    starts = related_starts(pool, fit, names, confused=True)
    lag = frozenset({"actuator_lag", "coulomb_friction"})
    assert {frozenset(n) for n, _ in starts} == plain | {lag}
    (column,) = pool.worlds.study.table.columns("actuator_lag")
    times = [values[column] for n, values in starts if frozenset(n) == lag]
    assert times == pytest.approx([0.03, 0.06, 0.015])
    pool.add([replace(fit, names=("actuator_lag", "coulomb_friction"), score=fit.score + 1.0)])
    again = {frozenset(n) for n, _ in related_starts(pool, fit, names, confused=True)}
    assert again == plain


def test_all_rows_are_asked_of_a_cause_that_was_nearly_worth_its_price(worlds) -> None:
    """One log's half of a price is not enough; what the others say of that cause is looked at."""
    first = SearchWorlds(Study([log(0)], ideal_model(), CATALOGUE, time_step=STEP))
    pool, whole = pool_of(first), pool_of(worlds)
    nothing, fit = started(pool), started(pool, viscous_friction=1.2)
    wider = started(pool, viscous_friction=1.2, coulomb_friction=0.6)
    both = frozenset(wider.names)
    for share, is_asked in ((0.1, False), (0.5, True)):
        near = replace(wider, score=fit.score - share * pool.bar("coulomb_friction"))
        pool.fits = {frozenset(f.names): f for f in (nothing, fit, near)}
        whole.fits, whole.price_share = {}, 0.3
        known = ("viscous_friction",)  # no survey may find the other
        assert strategy.go_on_all_rows(pool, fit, whole, known, lambda _: None) is is_asked
        assert (both in whole.fits) is is_asked


def test_the_best_of_what_was_nearly_worth_its_price_are_asked(worlds, monkeypatch) -> None:
    """One cause that lacks a third of a price goes before one that lacks two thirds."""
    pool = pool_of(worlds)
    fit = started(pool, viscous_friction=1.2)
    lacking = {"coulomb_friction": 2.0 / 3.0, "stribeck_friction": 1.0 / 3.0}
    for name, prices in lacking.items():
        wider = started(pool, viscous_friction=1.2, **{name: 0.6})
        score = fit.score - pool.bar(name) + prices * pool.price
        pool.fits[frozenset(wider.names)] = replace(wider, score=score)
    monkeypatch.setattr(strategy, "RIVALS", 1)
    (best,) = strategy.nearly_worth(pool, fit, 0.3)
    assert best.names == ("viscous_friction", "stribeck_friction")


def test_what_moves_and_reads_alike_with_other_forces_is_tried() -> None:
    """Softer springs and dampers do what a stronger servo does, but for weight and inertia.

    The cell reads as much less as the servo is stronger. No exchange of one cause leads there.
    """
    planted = {"gain_error": {"scale": 1.25}, "load_cell_gain": {"scale": 0.8}}
    names = (*planted, "joint_stiffness_error", "joint_damping_error")
    study = Study([log(n, **planted) for n in range(3)], ideal_model(), names, time_step=STEP)
    pool = pool_of(SearchWorlds(study))
    fit = started(pool, joint_stiffness_error=0.8, joint_damping_error=0.82)
    starts = similar_starts(pool, fit, names)
    assert {frozenset(n) for n, _ in starts} == {frozenset(planted)}
    for _, values in starts:
        assert sorted(values.values()) == pytest.approx([0.8, 1.25], rel=0.03)
    pool.add([fit])
    assert frozenset(settle(pool, fit, names).names) == frozenset(planted)
    pool.fits.clear()
    decided = Decided(fit=fit, held_out=dict.fromkeys(fit.names, 1.0))
    assert frozenset(with_other_forces(pool, decided, names).fit.names) == frozenset(planted)
    decided = replace(decided, fit=pool.best())
    assert with_other_forces(pool, decided, names) is decided
    pool.fits.clear()
    refused = Decided(fit=fit, refused={"gain_error": Refusal(gain=0.0)})
    assert with_other_forces(pool, refused, names) is refused
    pool.fits.clear()
    pruning.exchange(pool, started(pool, joint_stiffness_error=0.8, joint_damping_error=0.5), names)
    assert frozenset(planted) in pool.fits, "dampers that need no name any more are dropped"
    pool.fits.clear()
    back = similar_starts(pool, started(pool, gain_error=1.25), names)
    both = {"joint_stiffness_error", "load_cell_gain"}
    assert [frozenset(n) for n, _ in back] == [both, both | {"joint_damping_error"}]


def test_a_larger_spool_is_tried_where_servo_and_cell_differ() -> None:
    """On springs a stronger servo and a cell that reads less do what a larger spool does."""
    names = ("gain_error", "load_cell_gain", "spool_radius_error", "joint_stiffness_error")
    planted = {"spool_radius_error": {"scale": 1.15}}
    study = Study([log(n, **planted) for n in range(3)], ideal_model(), names, time_step=STEP)
    pool = pool_of(SearchWorlds(study))
    fit = started(pool, gain_error=0.83, load_cell_gain=1.15)
    starts = {frozenset(n): sorted(v.values()) for n, v in similar_starts(pool, fit, names)}
    assert starts[frozenset(planted)] == pytest.approx([1.15], rel=0.06)
    assert starts[frozenset({"spool_radius_error", "gain_error"})] == pytest.approx(
        [0.83 * 1.15, 1.15], rel=0.01
    )
    pool.add([fit])
    assert frozenset(settle(pool, fit, names).names) == frozenset(planted)


def test_a_limit_starts_wherever_the_survey_looked() -> None:
    """Half of the greatest force is far from the linear answer to one that hardly limits."""
    names = ("force_saturation", "coulomb_friction")
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    view = survey(pool.worlds, started(pool), names, pool.floors, coarse=True)
    starts = new_starts(pool, view, Chooser(view, PRICE, 7).singles(5))
    limit, knee = pool.worlds.study.table.columns("force_saturation")
    looked = {c.values[limit] for c in view.columns if limit in c.values}
    begun = [values for n, values in starts if n == ("force_saturation",)]
    assert len(looked) == 5
    assert looked <= {values[limit] for values in begun}
    assert {values[knee] for values in begun} == {pool.worlds.study.parameter(knee).nominal}
    assert sum(n == ("coulomb_friction",) for n, _ in starts) == 1


def test_a_motors_force_is_limited_beyond_what_the_tendon_shows() -> None:
    """A motor that gives 18.9 N shows 17.3 N behind a friction of 1.5 N: its limit is found."""
    planted = {"coulomb_friction": {"force": 1.5}, "force_saturation": {"limit": 18.9}}
    names = ("force_saturation", "coulomb_friction")
    study = Study([log(2, **planted)], ideal_model(), names, time_step=STEP)
    pool = pool_of(SearchWorlds(study))
    fit = started(pool, coulomb_friction=1.5)
    view = survey(pool.worlds, fit, names, pool.floors, coarse=True)
    starts = new_starts(pool, view, Chooser(view, PRICE, 7).singles(5))
    best = strategy.follow(pool, view, starts, coarse=1)[0]
    found = values_of(pool.worlds, best.columns, best.place)
    assert found[study.table.columns("force_saturation")[0]] == pytest.approx(18.9, rel=0.01)


def test_no_set_holds_a_law_and_its_special_case(worlds: SearchWorlds) -> None:
    """Coulomb friction takes the place of hysteresis, though it is forced into a set."""
    names = ("hysteresis", *CATALOGUE)
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, hysteresis=0.3)
    chooser = Chooser(survey(pool.worlds, fit, names, pool.floors, coarse=True), PRICE, 7)
    for trial in choose(chooser, 20):
        found = chooser.names(trial)
        assert not any(are_related(one, other) for one in found for other in found)


def test_a_special_case_takes_no_place_beside_its_law(worlds: SearchWorlds) -> None:
    """Hysteresis beside Stribeck's law goes at its edge: Coulomb friction is in the law already."""
    names = ("hysteresis", *CATALOGUE)
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, hysteresis=0.3, stribeck_friction=0.3)
    pool.add([fit])
    found = special_case_or_without(pool, fit, "hysteresis")
    assert found.names == ("stribeck_friction",)
    pool.add([started(pool, coulomb_friction=0.3, stribeck_friction=0.3)])
    assert frozenset({"coulomb_friction", "stribeck_friction"}) not in pool.fits


def test_a_law_at_the_edge_of_its_range_gives_way_to_its_special_case(worlds: SearchWorlds) -> None:
    """Bristles as short as they may be are Coulomb friction, also where no one fitted that."""
    names = ("hysteresis", *CATALOGUE)
    pool = pool_of(SearchWorlds(Study([log(0), log(1)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, hysteresis=0.6, viscous_friction=1.2)
    edge = dict(zip(pool.worlds.study.table.columns("hysteresis"), (0.6, 1.0e-4, 1.0), strict=True))
    pool.add([fit])
    found = special_case_or_without(pool, fit, "hysteresis")
    assert set(found.names) == {"coulomb_friction", "viscous_friction"}
    shortest = {**values_of(pool.worlds, fit.columns, fit.place), **edge}
    (ended,) = start_fits(pool.worlds, [(fit.names, shortest)], pool.floors)
    assert within_ranges(pool, ended) is found
    (column,) = pool.worlds.study.table.columns("coulomb_friction")
    assert values_of(pool.worlds, found.columns, found.place)[column] == pytest.approx(0.6, rel=0.1)


@pytest.mark.parametrize(("shortest", "left"), [(1.0e-4, True), (2.0e-4, False)])
def test_a_law_that_may_be_its_special_case_leaves_both(shortest: float, left: bool) -> None:
    """Bristles as short as the law has them are dry friction, however little else they fit."""
    study = Study([log(0)], ideal_model(), ("coulomb_friction", "hysteresis"), time_step=STEP)
    pool = pool_of(SearchWorlds(study))
    law, special = started(pool, hysteresis=0.6), started(pool, coulomb_friction=0.6)
    pool.add([law, special])
    force, travel, exponent = study.table.columns("hysteresis")
    ends = {force: (0.5, 0.7), travel: (shortest, 3.0e-4), exponent: (0.0, 2.0)}
    found: Any = SimpleNamespace(intervals=ends)
    rivals = special_case_left_open(pool, law, found, "hysteresis")
    assert [rival.names for rival in rivals] == [special.names] * left


def test_without_a_wrong_clock_times_are_the_logs_own() -> None:
    """A lag of 60 ms beside seconds a fifth too long is one of 50 ms; a shape stays."""
    names = ("actuator_lag", "sample_period_error", "stribeck_friction")
    worlds = SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP))
    pool = pool_of(worlds)
    fit = started(pool, actuator_lag=0.05, sample_period_error=1.2, stribeck_friction=0.5)
    kept, values = without(fit, "sample_period_error", worlds)
    assert kept == ("actuator_lag", "stribeck_friction")
    assert list(values.values()) == pytest.approx([0.05, 0.5])
    told = found_of(pool, fit)
    assert list(told.values.values()) == pytest.approx([0.06, 1.2, 0.5])
    assert [n.coordinate.value(n.place) for n in told.numbers] == pytest.approx([0.06, 1.2, 0.5])
    column = worlds.study.table.columns("actuator_lag")[0]
    low, high = told.intervals[column]
    assert low < 0.06 < high
    assert worlds.in_seconds(told.values, -1) == pytest.approx(
        values_of(worlds, fit.columns, fit.place)
    )


def test_a_wrong_clock_changes_nothing_beside_all_that_resists_motion() -> None:
    """Seconds a tenth too long make a mechanism lighter by a fifth, and less damped by a tenth."""
    names = ("inertia_error", "joint_damping_error", "sample_period_error")
    study = Study([log(0)], ideal_model(), names, time_step=STEP)
    worlds = SearchWorlds(study)
    inertia, damping, clock = (study.table.columns(name)[0] for name in names)
    own, wrong = {inertia: 2.0, damping: 3.0}, {inertia: 2.0, damping: 3.0, clock: 1.1}
    assert worlds.in_seconds(wrong) == pytest.approx({inertia: 2.42, damping: 3.3, clock: 1.1})
    right, late, lighter = worlds.residuals([own, wrong, {**own, inertia: 1.8}])
    assert np.abs(late - right).max() < 0.05 * np.abs(lighter - right).max()


def test_every_unit_with_a_time_in_it_has_its_power() -> None:
    """A unit that is missing would keep its number where a wrong clock goes; so on a shaft."""
    laws = [*EFFECTS.values(), *ACTUATORS.values()]
    units = {p.of or p.unit for law in laws for p in law.parameters} | set(ON_A_SHAFT.values())
    timed = {unit for unit in units if {"s", "s2"} & set(re.split("[ /]", unit))}
    assert "rad/s2" in timed
    assert timed <= set(TIME_POWERS)


def test_a_smaller_set_is_compared_at_its_best() -> None:
    """A cause that does nothing is worth nothing, though the set without it was left far off."""
    names = ("coulomb_friction", "viscous_friction", "load_dependent_friction")
    logs = [log(n) for n in range(3)]
    pool = pool_of(SearchWorlds(Study(logs, ideal_model(), names, time_step=STEP)))
    start = started(pool, viscous_friction=1.0, coulomb_friction=0.5, load_dependent_friction=0.0)
    (fit,) = refit(pool.worlds, [start], pool.floors, iterations=12)
    far = started(pool, viscous_friction=0.1, coulomb_friction=3.0)
    pool.add([fit, replace(far, settled=True)])
    less = leave_out(pool, fit)["load_dependent_friction"]
    assert less.score == pytest.approx(fit.score, abs=0.01)
    assert far.score > fit.score + 1.0


def test_a_breakaway_force_is_granted_more_by_a_verdict_alone(worlds: SearchWorlds) -> None:
    """What jumps misses more: that must not hide another cause from the search."""
    dry, jumping = ("coulomb_friction",), ("stribeck_friction",)
    assert floors_of(worlds, jumping) == floors_of(worlds, dry)
    missed = LADDER * form_of(worlds, jumping, 1.0).theta
    usual = floors_of(worlds, jumping, usual=True)
    assert usual.theta == pytest.approx(np.hypot(worlds.study.noise.theta, missed))


def test_a_cause_is_worth_at_least_what_it_is_said_to_be_on_left_out_parts(worlds) -> None:
    """The sets without them saw all parts: refits that did not see a part do worse there."""
    pool = pool_of(worlds)
    start = started(pool, viscous_friction=1.0, coulomb_friction=0.5)
    (fit,) = refit(worlds, [start], pool.floors, iterations=10)
    pool.add([fit])
    less = leave_out(pool, fit, clear=np.inf)
    own, *others = (found for f in (fit, *less.values())
                    if (found := unseen_terms(worlds, f, pool.floors)) is not None)  # fmt: skip
    gains = held_out_gains(pool, fit, fit.names)
    for name, other in zip(less, others, strict=True):
        assert pool.bar(name) < gains[name] < float((other - own).sum()) + 0.01
    known = {"viscous_friction": 5.0}
    assert gains_of(pool, fit, known) == known | {"coulomb_friction": gains["coulomb_friction"]}


def test_what_is_left_out_tells_nothing_of_what_it_alone_shows(worlds: SearchWorlds) -> None:
    """A direction of which the seen rows tell a tenth is held; one that they tell is not."""
    seen = np.arange(1000) < 900
    slopes = np.zeros((1000, 2))
    slopes[seen, 0] = 1.0
    slopes[:100, 1], slopes[~seen, 1] = 1.0, 3.0
    fit: Any = SimpleNamespace(residual=np.zeros(1000))
    hold = untold(fit, slopes, np.ones(1000), seen)
    assert hold[1, 1] > 100.0 * 900.0
    assert hold[0, 0] == pytest.approx(0.0, abs=1e-6)


def test_what_is_stated_is_a_cause_beyond_its_tolerance_alone(worlds: SearchWorlds) -> None:
    """A cell's gain stays within 3 %; a tolerance costs half a nat, and nothing of a cause does."""
    logs, causes = worlds.study.wholes, ("load_cell_gain",)
    own = SearchWorlds(Study(logs, ideal_model(), causes, time_step=SEARCH_STEP, tolerant=True))
    (column,) = own.study.table.columns("load_cell_gain")
    inside, beyond = start_fits(own, [((), {column: 1.2}), (("load_cell_gain",), {column: 1.2})],
                                floors_of(own, ()))  # fmt: skip
    assert values_of(own, inside.columns, inside.place)[column] == pytest.approx(1.03, abs=1e-3)
    assert values_of(own, beyond.columns, beyond.place)[column] == pytest.approx(1.2)
    _, back = without(beyond, "load_cell_gain", own)
    assert back[column] == pytest.approx(1.03, abs=1e-3)
    assert surprise(own, inside) == pytest.approx(2.0, abs=0.1)  # two tolerances
    assert surprise(own, beyond) == 0.0


@pytest.mark.parametrize("is_left", [False, True])
def test_beside_what_no_cause_explains_a_name_costs_three_prices(
    worlds: SearchWorlds, monkeypatch: pytest.MonkeyPatch, is_left: bool
) -> None:
    """A cause that is worth two prices is suspected where something is left, and else named."""
    pool = pool_of(worlds)
    fit, name = started(pool, viscous_friction=1.0), "viscous_friction"
    monkeypatch.setattr(Pool, "leaves_nothing", lambda *_, **__: not is_left)
    two = {name: 2.0 * PRICE}
    decided = Decided(fit=fit, losses=two, held_out=two)
    (column,) = worlds.study.table.columns(name)
    found: Any = SimpleNamespace(intervals={column: (0.5, 1.5)})
    criteria = criteria_of(pool, fit, decided, found, name)
    assert [c.name for c in criteria if not c.passed] == [REMAINS] * is_left


def test_forms_of_one_friction_may_be_further_behind(worlds: SearchWorlds) -> None:
    """Dry frictions of a gear are one family; what its load presses out of it is another."""
    pool = pool_of(worlds)
    near, far = (room(pool, "coulomb_friction", name)
                 for name in ("load_dependent_friction", "stribeck_friction"))  # fmt: skip
    assert (near, far) == pytest.approx((PRICE, 5.0 * PRICE))


def test_a_number_that_lies_at_the_end_of_its_tolerances_is_told(worlds, monkeypatch) -> None:
    """A cell that reads a tenth too little hid in 3 %: the rest was left, and nobody was told.

    Where nothing is known of it once it is free, it stays in its tolerance, and the answer stays.
    """
    names, causes = ("load_cell_gain", *TRUTH), tuple(TRUTH)
    wrong = [replace(r, force=0.9 * r.force) for r in worlds.study.wholes if r.force is not None]
    own = SearchWorlds(Study(wrong, ideal_model(), names, time_step=STEP, tolerant=True))
    pool = pool_of(own)
    start = {own.study.table.columns(c)[0]: v for c, v in zip(causes, (0.6, 1.2), strict=True)}
    begun = start_fits(own, [((), {}), (causes, start)], pool.floors)
    pool.add(refit(own, begun, pool.floors, iterations=6))
    (cell,), fit = own.study.table.columns("load_cell_gain"), pool.fits[frozenset(causes)]
    decided = Decided(fit=fit, held_out=dict.fromkeys(causes, 1.0))
    found = with_told(pool, decided, names)
    assert set(found.fit.names) == set(names)
    assert values_of(own, found.fit.columns, found.fit.place)[cell] == pytest.approx(0.9, abs=0.01)
    assert found.told == {"load_cell_gain": pytest.approx(7.0, abs=1.0)}
    monkeypatch.setattr(told, "is_within", lambda *_: True)
    assert with_told(pool, decided, names) is decided


def test_a_number_of_the_price_is_paid_in_nats_by_rows_that_err_alone(worlds: SearchWorlds) -> None:
    """Where noise is all that is left, many rows tell, and a small gain each is enough."""
    pool = pool_of(worlds)
    assert pool.price == PRICE
    start = started(pool, viscous_friction=1.2, coulomb_friction=0.6)
    pool.add(refit(worlds, [start], pool.floors, iterations=6))
    alone = worlds.rows_alone(pool.best().residual, pool.floors)
    assert pool.price == pytest.approx(min(PRICE, NATS / alone))


def test_rows_share_what_a_law_may_miss_below_the_noise(worlds: SearchWorlds) -> None:
    """Else a false cause gains ten prices where noise is left, by a tenth of its size."""
    sharp = least_scales(worlds.study, usual_form(worlds.study), 0.0, 1.0)
    floors = floors_of(worlds, ("coulomb_friction",))
    quiet = 0.5 * worlds.where.sizes(sharp)
    assert worlds.rows_together(quiet, sharp) == 1.0
    rows = worlds.rows_alone(quiet, sharp) / worlds.where.block_count / BLOCK
    shares = [1.0 - (sharp.of(s) / floors.of(s)) ** 2 for s, _ in worlds.where.signals]
    told = 1.0 + np.mean(shares) * (rows / INDEPENDENT - 1.0)
    assert worlds.rows_together(quiet, floors) == pytest.approx(told)
    assert told > 3.0


def test_a_model_states_tolerances_of_its_own(worlds: SearchWorlds) -> None:
    """Half the tolerance is half the room; what nothing states has none, and is refused."""
    logs, causes = worlds.study.wholes, ("load_cell_gain",)

    def room(**tolerances: float) -> float:
        model = replace(ideal_model(), tolerances=tolerances)
        own = SearchWorlds(Study(logs, model, causes, time_step=SEARCH_STEP, tolerant=True))
        low, high = own.as_built(own.study.table.columns("load_cell_gain")[0])
        return high - low

    assert room(load_cell_gain=0.0075) == pytest.approx(0.5 * room(), rel=0.01)
    with pytest.raises(UnknownName, match="known: load_cell_gain"):
        room(load_cell_gian=0.01)


def test_each_number_of_a_law_has_its_price() -> None:
    """The same gain is worth a half in a law of two numbers, and costs twice as much."""
    rows, fit, less = residuals(0.05, 30.0)
    pool = Pool(worlds=rows, floors=FLOORS, dearest=2.0 * PRICE, most=7)
    one, two = (pool.worth(fit, less, name) for name in ("speed_limit", "acceleration_limit"))
    assert one == pytest.approx(2.0 * two)
    plain, longer = (replace_names(fit, name) for name in ("speed_limit", "acceleration_limit"))
    assert pool.cost(longer) - pool.cost(plain) == pytest.approx(2.0 * PRICE)


def replace_names(fit: Any, *names: str) -> Any:
    """The same fit under other names."""
    return SimpleNamespace(**{**vars(fit), "names": names})


def test_an_interval_holds_what_other_sets_say_by_their_weight(worlds: SearchWorlds) -> None:
    """Both spreads add up as variances do; a refused cause says nothing."""
    pool = pool_of(worlds)
    start = started(pool, viscous_friction=1.2, coulomb_friction=0.6)
    (fit,) = refit(worlds, [start], pool.floors, iterations=4)
    (column,) = worlds.study.table.columns("viscous_friction")
    place = np.where(np.array(fit.columns) == column, fit.place + 0.2, fit.place)
    beside = replace(fit, names=("viscous_friction", "hysteresis"), place=place)
    point = found_of(pool, fit).point
    rows = max(int(own.sum()) for _, own in worlds.where.signals)
    behind = np.log(3.0) * 9.0 * rows_together(point, worlds.where) / rows
    beside = replace(beside, score=fit.score + pool.cost(fit) - pool.cost(beside) + behind)
    pool.add([fit, beside])
    share = weights_of(pool, point, fit, ())[frozenset(beside.names)]
    assert share == pytest.approx(0.25)
    alone, among = (found_of(pool, fit, refused=r).intervals[column] for r in (("hysteresis",), ()))
    assert alone == found_of(pool, fit).intervals[column]
    unit = worlds.coordinate(column).unit
    slack = 1.5e-2 * found_of(pool, fit).values[column]
    half, whole = (0.5 * (high - low) - slack for low, high in (alone, among))
    assert whole == pytest.approx(np.hypot(half, 1.96 * 0.2 * unit * np.sqrt(share)), rel=1e-3)


@pytest.mark.parametrize("scale", [0.98, 1.05])
def test_an_interval_holds_what_is_too_small_to_be_named(scale: float) -> None:
    """A gain worth two prices moves the friction by as much as the interval grows.

    What may stand in the friction's place, or is a number of the fit itself, says nothing of it.
    Friction that is just worth its price is no smaller.
    """
    truth = {"viscous_friction": {"coefficient": 1.2}, "gain_error": {"scale": scale}}
    study = Study([log(n, **truth) for n in range(2)], ideal_model(), (*truth,), time_step=STEP)
    pool = pool_of(SearchWorlds(study))
    pool.floors = replace(pool.floors, theta=0.05, force=0.5)
    starts = [
        started(pool, viscous_friction=1.2),
        started(pool, viscous_friction=1.2, gain_error=scale),
    ]
    one, both = refit(pool.worlds, starts, pool.floors, iterations=6)
    pool.add([one, both])
    pool.dearest = 0.5 * pool.gain(both, one)
    (column,) = study.table.columns("viscous_friction")
    place = one.columns.index(column)
    moved = abs(one.place[place] - both.place[place]) * pool.worlds.coordinate(column).unit
    alone, rival = found_of(pool, one), {"viscous_friction": ("gain_error",)}
    found = [
        with_unnamed(pool, one, alone, names, classes, {}).intervals[column]
        for names, classes in (
            ((), {}), (("gain_error",), {}), (("gain_error",), rival), (("viscous_friction",), {}),
        )
    ]  # fmt: skip
    half, whole, *same = (0.5 * (high - low) for low, high in found)
    assert np.sqrt(whole**2 - half**2) == pytest.approx(moved, rel=0.1)
    assert same == pytest.approx([half, half])
    least = with_unnamed(pool, one, alone, ("gain_error",), {}, {"viscous_friction": 1.0})
    assert least.intervals[column] == pytest.approx((found[0][0], found[1][1]))
    (gain,) = refit(pool.worlds, [started(pool, gain_error=0.9)], pool.floors, iterations=4)
    own, (column,) = found_of(pool, gain), study.table.columns("gain_error")
    sure = (0.99 * own.values[column], 1.01 * own.values[column])
    own = replace(own, intervals={**own.intervals, column: sure})
    open_, least = (
        with_unnamed(pool, gain, own, ("viscous_friction",), {}, worths).intervals[column]
        for worths in ({}, {"gain_error": 1.0})
    )
    assert open_[1] > least[1] == pytest.approx(sure[1])
    assert open_[0] == least[0] < sure[0], "away from 1, which means nothing"


def test_a_cause_is_as_probable_as_the_sets_that_hold_it(worlds: SearchWorlds) -> None:
    """Sets that are as likely share the weight; one with a refused cause has none."""
    pool = pool_of(worlds)
    one, two = started(pool, viscous_friction=1.0), started(pool, coulomb_friction=0.5)
    fit = started(pool, viscous_friction=1.0, coulomb_friction=0.5)
    pool.fits = {frozenset(f.names): replace(f, score=s) for f, s in
                 ((one, 1.0), (two, 1.0), (fit, 1.0 - PRICE))}  # fmt: skip
    point = Linearisation(residual=fit.residual, jacobian=np.ones((len(fit.residual), 1)))
    weights = weights_of(pool, point, fit, ())
    assert probability(weights, "viscous_friction", ()) == pytest.approx(2.0 / 3.0)
    assert probability(weights, "viscous_friction", ("coulomb_friction",)) == pytest.approx(1.0)
    kept = weights_of(pool, point, fit, ("coulomb_friction",))
    assert probability(kept, "viscous_friction", ()) == 1.0


def test_what_blocks_share_tells_sets_apart_as_much_less(worlds: SearchWorlds) -> None:
    """A hundredth of a nat a row over 480 rows, of which nine tell as much as one alone would."""
    pool, one = pool_of(worlds), started(pool_of(worlds), viscous_friction=1.0)
    two = replace(one, score=1.0), replace(one, names=("gain_error",), score=1.01)
    pool.fits = {frozenset(f.names): f for f in two}
    white = np.random.default_rng(0).normal(size=len(one.residual))
    point = Linearisation(residual=white, jacobian=np.ones((len(white), 1)))
    weights = weights_of(pool, point, two[0], ())
    rows = max(int(own.sum()) for _, own in worlds.where.signals)
    odds = weights[frozenset({"viscous_friction"})] / weights[frozenset({"gain_error"})]
    assert odds == pytest.approx(np.exp(0.01 * rows / rows_together(point, worlds.where) / 9.0))


def test_worlds_are_drawn_from_all_sets_that_have_weight(worlds: SearchWorlds) -> None:
    """Numbers as wide as their intervals, with the correlation of the fit."""
    pool = pool_of(worlds)
    start = started(pool, viscous_friction=1.0, coulomb_friction=0.5)
    (fit,) = refit(worlds, [start], pool.floors, iterations=10)
    pool.add([fit, started(pool, viscous_friction=1.2)])
    found, other = found_of(pool, fit), frozenset({"viscous_friction"})
    posterior = posterior_of(pool, found, fit, {frozenset(fit.names): 0.75, other: 0.25}, {})
    assert [(s.weight, set(s.causes)) for s in posterior.sets] == [
        (0.75, set(fit.names)), (0.25, set(other)),
    ]  # fmt: skip
    (own, _), rng = posterior.sets, np.random.default_rng(0)
    values = own.at(rng.normal(size=(20_000, len(own.numbers)))).T
    drawn = {(n.owner, n.name): v for n, v in zip(own.numbers, values, strict=True)}
    for column, (low, high) in found.intervals.items():
        owner, parameter = worlds.study.table.owners[column]
        ends = np.quantile(drawn[owner, parameter.name], (0.025, 0.975))
        assert ends == pytest.approx((low, high), abs=0.1 * (high - low))
    linear = found.point.jacobian.T @ found.point.jacobian
    together = np.corrcoef([*drawn.values()])[0, 1]
    assert np.sign(together) == np.sign(np.linalg.inv(linear)[0, 1])
    assert abs(together) > 0.3


def test_a_class_is_part_of_the_posterior(worlds: SearchWorlds) -> None:
    """An experiment needs the numbers of what a diagnosis cannot tell from a cause that it names.

    A set that is of no class is left out where its weight is as small.
    """
    pool = pool_of(worlds)
    fit, rival = started(pool, coulomb_friction=0.5), started(pool, viscous_friction=0.5)
    pool.add([fit, rival])
    keys = [*(frozenset(one.names) for one in (fit, rival)), frozenset({"gain_error"})]
    weights = dict(zip(keys, (0.998, 0.001, 0.001), strict=True))
    alike = {keys[1]: found_of(pool, rival)}
    posterior = posterior_of(pool, found_of(pool, fit), fit, weights, alike)
    assert [own.causes for own in posterior.sets] == [fit.names, rival.names]


def test_no_world_has_a_law_of_which_the_answer_has_the_special_case(worlds: SearchWorlds) -> None:
    """A falling friction that errors of form explain as well is in no world, its class or not."""
    pool = pool_of(worlds)
    fit, richer = started(pool, coulomb_friction=0.5), started(pool, stribeck_friction=0.5)
    pool.add([fit, richer])
    weights = {frozenset(fit.names): 0.1, frozenset(richer.names): 0.9}
    for alike in ({}, {frozenset(richer.names): found_of(pool, richer)}):
        posterior = posterior_of(pool, found_of(pool, fit), fit, weights, alike)
        assert [own.causes for own in posterior.sets] == [fit.names]
    assert len(posterior_of(pool, found_of(pool, richer), richer, weights, {}).sets) == 2


def test_a_set_that_is_not_followed_is_clearly_worse_at_its_end_too(worlds: SearchWorlds) -> None:
    """Two steps with the derivatives of the whole set tell; its own lead no nearer."""
    pool, followed = pool_of(worlds), pool_of(worlds)
    start = started(pool, viscous_friction=1.0, coulomb_friction=0.5)
    (fit,) = refit(worlds, [start], pool.floors, iterations=10)
    left, ends = leave_out(pool, fit), leave_out(followed, fit, clear=np.inf)
    for name in fit.names:
        assert not left[name].settled
        assert ends[name].score - fit.score > CLEAR * PRICE


def test_intervals_are_those_of_the_loss_that_was_minimised(worlds, monkeypatch) -> None:
    """Its slope is zero where a descent ended: rows that count a tenth do so in both."""
    counts = np.where(np.arange(len(worlds.where.signal)) % 3, 1.0, 0.1)
    monkeypatch.setattr(SearchWorlds, "weights", lambda *_: counts)
    pool = pool_of(worlds)
    start = started(pool, coulomb_friction=0.5, viscous_friction=1.0)
    (fit,) = refit(worlds, [start], pool.floors, iterations=15)
    point = found_of(pool, fit).point
    off, even = (
        np.abs(np.linalg.solve(p.normal_matrix(), p.gradient())).max()
        for p in (point, replace(point, weight=1.0))
    )
    assert off < 0.2 * even


def test_an_interval_that_holds_none_names_nothing(worlds: SearchWorlds) -> None:
    """Stribeck's speed shapes it: its two forces alone tell whether there is any.

    Where both are open to 0.2 N each and their difference, 0.2 N, to 0.01 N, there is some.
    """
    study, table = worlds.study, worlds.study.table
    (viscous,) = table.columns("viscous_friction")
    coulomb, breakaway, speed = table.columns("stribeck_friction")
    places = {viscous: 0.5, coulomb: 0.2, breakaway: 0.4, speed: 1.5}
    numbers = [SimpleNamespace(coordinate=worlds.coordinate(c), place=places[c]) for c in places]
    found: Any = SimpleNamespace(
        intervals={viscous: (0.0, 1.3), coulomb: (0.0, 0.5), breakaway: (0.0, 0.6), speed: (1, 2)},
        values=places,
        numbers=numbers,
        covariance=np.diag([0.1, 0.04, 0.04, 0.1]),
    )
    assert holds_null(study, found, "viscous_friction")
    assert holds_null(study, found, "stribeck_friction")
    found.covariance[1, 2] = found.covariance[2, 1] = 0.04 - 5.0e-5
    assert not holds_null(study, found, "stribeck_friction")
    found.covariance[1, 2] = found.covariance[2, 1] = found.covariance[1, 1] = 0.0
    assert holds_null(study, found, "stribeck_friction")  # one is held: it says nothing
    found.covariance = 1.0e-4 * np.diag([0.1, 0.04, 0.04, 0.1])
    assert holds_null(study, found, "stribeck_friction")  # other sets left intervals as wide
    found.intervals |= {viscous: (0.1, 1.3), breakaway: (0.1, 0.6)}
    assert not holds_null(study, found, "viscous_friction")
    assert not holds_null(study, found, "stribeck_friction")


@pytest.mark.parametrize(("unsure", "behind"), [(1, 2.0), (2, 2.0), (3, 2.0), (2, 9.0)])
def test_what_is_sure_stands_for_causes_that_share_it(
    worlds: SearchWorlds, monkeypatch: pytest.MonkeyPatch, unsure: int, behind: float
) -> None:
    """Two causes of three that may be nothing give way to one that is not, unless it is far behind.

    A single one stays.
    """
    pool, causes = pool_of(worlds), ("viscous_friction", "coulomb_friction", "command_delay")
    start = started(pool, viscous_friction=1.0)
    sets = fit, other, sure = [
        replace(start, names=names, score=1.0 + PRICE * prices)
        for names, prices in (
            (causes, 0.0),
            (("actuator_lag",), 1.0),
            (("viscous_friction", "actuator_lag"), behind),
        )
    ]
    pool.add(sets)
    unsure_ones = causes[-unsure:]
    gains = dict.fromkeys((*causes, "actuator_lag"), 1.0)
    monkeypatch.setattr(told, "found_of", lambda _, own: own)
    monkeypatch.setattr(told, "holds_null", lambda *given: given[-1] in unsure_ones)
    monkeypatch.setattr(told, "followed", lambda _, own: own)
    monkeypatch.setattr(told, "held_out_gains", lambda *_: gains)
    monkeypatch.setattr(told, "with_worths", lambda decided, *_: decided)
    answer = with_deserved(pool, Decided(fit=pool.fits[frozenset(fit.names)]), causes)
    expected = {1: fit, 2: sure if behind < 3.0 else fit, 3: other}[unsure]
    assert set(answer.fit.names) == set(expected.names)


def test_what_helps_to_predict_is_written_though_it_has_no_name(worlds: SearchWorlds) -> None:
    """Unless it ended at the edge of its range, where it stands for something else."""
    pool = pool_of(worlds)
    named = started(pool, coulomb_friction=0.6)
    pool.add([named, started(pool, coulomb_friction=0.6, viscous_friction=1.2)])
    terms = unseen_terms(worlds, named, pool.floors)
    assert terms is not None
    own = float(terms.sum())
    best, predicts = best_predictor(pool, Decided(fit=named))
    assert set(best.names) == {"coulomb_friction", "viscous_friction"}
    assert predicts < own
    refused = {"viscous_friction": Refusal(gain=0.0, at_bound=True)}
    assert best_predictor(pool, Decided(fit=named, refused=refused)) == (named, own)


def test_what_ends_as_nothing_is_not_written(worlds, monkeypatch) -> None:
    """A set is followed before it is asked what it predicts, and a cause of it may vanish there."""
    pool = pool_of(worlds)
    named = started(pool, coulomb_friction=0.6)
    pool.add([named, started(pool, coulomb_friction=0.6, viscous_friction=1.2)])
    vanished = started(pool, coulomb_friction=0.6, viscous_friction=0.0)
    monkeypatch.setattr(decision, "followed", lambda *_: vanished)
    monkeypatch.setattr(
        Pool, "unseen_terms", lambda _, fit, *__: np.array([-1.0e3 * len(fit.names)])
    )
    best, _ = best_predictor(pool, Decided(fit=named))
    assert best is named


def test_what_is_written_grows_by_what_no_set_had(worlds: SearchWorlds) -> None:
    """The search never fitted both frictions together, and the answer leaves the second."""
    pool = pool_of(worlds)
    named = followed(pool, started(pool, coulomb_friction=0.6))
    pool.add([followed(pool, started(pool))])
    found = with_predictor(pool, Decided(fit=named), {}, CATALOGUE)
    assert found.predictor is not None
    assert set(found.predictor.names) == {"coulomb_friction", "viscous_friction"}
    assert found.fit is named


def test_no_set_that_was_fitted_is_ahead_of_the_answer_by_a_price(worlds: SearchWorlds) -> None:
    """The search goes on from a better one, to what neither had; from none it does not."""
    pool = pool_of(worlds)
    poor, better = started(pool, coulomb_friction=0.5), started(pool, viscous_friction=1.2)
    pool.add([started(pool), poor, better])
    decided = Decided(fit=poor)
    found = searched_further(pool, decided, CATALOGUE)
    assert set(found.fit.names) == {"coulomb_friction", "viscous_friction"}
    assert searched_further(pool, found, CATALOGUE) is found
    fresh, refusal = pool_of(worlds), Refusal(gain=0.0)
    fresh.add([poor, better])
    refused = Decided(fit=poor, refused={"viscous_friction": refusal})
    assert searched_further(fresh, refused, CATALOGUE) is refused


@pytest.mark.parametrize("lost", ["ahead by less than a price", "unseen parts", "no time"])
def test_a_search_does_not_go_on_for_nothing(lost: str, worlds, monkeypatch) -> None:
    """A set that predicts worse than its numbers cost is left, and so is one that hardly leads."""
    pool = pool_of(worlds)
    poor, better = started(pool, coulomb_friction=0.5), started(pool, viscous_friction=1.2)
    pool.add([started(pool), poor, better])
    if lost == "unseen parts":
        monkeypatch.setattr(decision, "predicted", lambda *_: 0.0)
    elif lost == "no time":
        pool.until = 0.0
    else:
        pool.fits[frozenset(poor.names)] = poor = replace(poor, score=better.score + 0.5 * PRICE)
        monkeypatch.setattr(decision, "grow", pytest.fail)
    decided = Decided(fit=poor)
    assert searched_further(pool, decided, CATALOGUE) is decided


def test_who_promises_less_than_its_cost_is_not_looked_at_again(worlds: SearchWorlds) -> None:
    """What is missing promises more, and the true set misses nothing."""
    pool = pool_of(worlds)
    named = followed(pool, started(pool, coulomb_friction=0.6))
    assert "viscous_friction" in look_further(pool, named, CATALOGUE)
    true = followed(pool, started(pool, coulomb_friction=0.6, viscous_friction=1.2))
    assert look_further(pool, true, CATALOGUE) == []


def test_a_class_takes_in_what_is_easily_confused_and_was_in_no_set(worlds: SearchWorlds) -> None:
    """Though nothing is left: what explains as much is told beside a cause."""
    pool = pool_of(worlds)
    named = followed(pool, started(pool, coulomb_friction=0.6, viscous_friction=1.2))
    fit_replacements(pool, named, CATALOGUE)
    assert frozenset({"stribeck_friction", "viscous_friction"}) in pool.fits


def test_a_set_that_may_come_close_is_followed_into_a_class(worlds, monkeypatch) -> None:
    """It goes on while it may; one that cannot come close is left where it is."""
    pool = pool_of(worlds)
    named = followed(pool, started(pool, coulomb_friction=0.6, viscous_friction=1.2))
    begun = started(pool, coulomb_friction=0.2, viscous_friction=0.4)
    near, far = pruning.follow_near(
        pool, [begun] * 2, np.array([named.score, -np.inf]), pruning.FOLLOWED
    )
    assert near.score < named.score + PRICE
    assert far is begun
    monkeypatch.setattr(decision, "follow_near", lambda _, fits, *__: [named for _ in fits])
    fit_replacements(pool, named, CATALOGUE)
    assert len(pool.fits) == 1


@pytest.mark.parametrize("step", ["followed_to_end", "with_predictor", "searched_further"])
def test_a_decision_takes_each_step(step, worlds, monkeypatch) -> None:
    """Where something is left: names of planted sets hardly change without one of them."""

    def reached(*_: Any) -> None:
        raise InterruptedError(step)

    pool = pool_of(worlds)
    fit = started(pool, coulomb_friction=0.6)
    pool.add([started(pool), fit])
    monkeypatch.setattr(decision, step, reached)
    with pytest.raises(InterruptedError, match=step):
        decide(pool, fit, pool, ("coulomb_friction",))


def test_a_special_case_that_was_left_behind_begins_where_its_law_stands(worlds) -> None:
    """Else the law is sharper than its special case, which explains as much."""
    pool = pool_of(worlds)
    law = started(pool, viscous_friction=1.2, stribeck_friction=0.6)
    poor = replace(started(pool, viscous_friction=1.2, coulomb_friction=0.2), settled=True)
    pool.add([law, poor])
    fit_special_cases(pool, law, "stribeck_friction")
    found = pool.fits[frozenset(poor.names)]
    assert found.score < poor.score - PRICE
    assert values_of(worlds, found.columns, found.place)[
        worlds.study.table.columns("coulomb_friction")[0]
    ] == pytest.approx(0.6, rel=0.1)


def test_a_descent_that_ended_early_is_begun_anew(worlds: SearchWorlds) -> None:
    """By short differences it was at its end."""
    pool = pool_of(worlds)
    early = replace(started(pool, coulomb_friction=0.9, viscous_friction=0.4), settled=True)
    pool.add([early])
    assert followed(pool, early).score == early.score
    assert followed_to_end(pool, early).score < early.score - PRICE


@pytest.mark.parametrize(
    ("causes", "has_force", "left_in_rows", "left_in_mean", "asked"),
    [
        ((), True, False, True, False),
        ((), False, False, True, False),
        ((), False, True, True, True),
        (("backlash",), True, False, False, False),
        (("backlash",), True, False, True, True),
        (("backlash",), False, False, False, True),
    ],
)
def test_plain_models_are_asked_where_something_may_be_left(
    causes: tuple[str, ...], has_force: bool, left_in_rows: bool, left_in_mean: bool, asked: bool
) -> None:
    """Of a named cause the mean counts too, and angles alone do not settle it."""

    def leaves_nothing(_: Fit, *, usual: bool, anywhere: bool = False) -> bool:
        assert usual
        return not (left_in_rows or (anywhere and left_in_mean))

    rows = np.ones(3, dtype=bool)
    signals = (("theta", rows), ("force", rows))[: 1 + has_force]
    worlds = SimpleNamespace(where=SimpleNamespace(signals=signals))
    pool: Any = SimpleNamespace(leaves_nothing=leaves_nothing, worlds=worlds)
    fit: Any = SimpleNamespace(names=causes)
    assert asks_plain_models(pool, fit) is asked


def test_a_model_that_is_written_has_each_named_cause(worlds: SearchWorlds) -> None:
    """A law that predicts better in the place of a named one would be another answer."""
    pool = pool_of(worlds)
    named = started(pool, viscous_friction=1.2)
    pool.add([named, started(pool, coulomb_friction=0.6), started(pool, stribeck_friction=0.6)])
    best, _ = best_predictor(pool, Decided(fit=named))
    assert best is named


def test_each_number_of_what_is_written_costs_the_choice_of_it(worlds, monkeypatch) -> None:
    """One of three causes: log(3) nat of what rows tell together on parts that nothing has seen."""
    pool = pool_of(worlds)
    named = started(pool, coulomb_friction=0.6)
    pool.add([named, started(pool, coulomb_friction=0.6, viscous_friction=1.2)])
    alone = worlds.rows_alone(named.residual, pool.floors)
    for gain, written in ((1.0, 1), (1.2, 2)):
        monkeypatch.setattr(
            Pool, "unseen_terms",
            lambda _, fit, *__, gain=gain: np.array([-gain / alone * (len(fit.names) - 1)]),
        )  # fmt: skip
        best, _ = best_predictor(pool, Decided(fit=named))
        assert len(best.names) == written


def test_what_a_model_says_exactly_is_no_cause() -> None:
    """A limit that a register holds."""
    model = replace(ideal_model(), tolerances={"coulomb_friction": 0.0})
    study = Study([log(0)], model, CATALOGUE, time_step=STEP)
    effects = testable.testable_effects(study)
    assert "coulomb_friction" not in effects
    assert "viscous_friction" in effects


def test_causes_without_a_name_are_in_the_model_that_is_written(worlds: SearchWorlds) -> None:
    """Coulomb friction is named; viscous friction helps to predict, and is suspected."""
    pool, train = pool_of(worlds), worlds.study
    sets: list[dict[str, float]] = [
        {}, {"coulomb_friction": 0.6}, {"coulomb_friction": 0.6, "viscous_friction": 1.2},
    ]  # fmt: skip
    start, named, both = (found_of(pool, started(pool, **values)) for values in sets)
    findings = Findings(
        verdict="partly_explained", baseline=start, final=named, closest=named, suspected=(),
        classes={}, candidates=(), criteria={"coulomb_friction": ()}, predictor=both,
    )  # fmt: skip
    test = Study([log(3)], ideal_model(), CATALOGUE, time_step=STEP, like=train)
    diagnosis, _ = conclude(
        train, findings, ideal_model(), test, np.random.default_rng(0), time.monotonic()
    )
    assert [effect.name for effect in diagnosis.effects] == ["coulomb_friction"]
    (helping,) = diagnosis.suspected
    assert (helping.name, helping.reason[:19]) == ("viscous_friction", "It helps to predict")
    assert {e.name for e in diagnosis.model.effects} == {"coulomb_friction", "viscous_friction"}
    assert diagnosis.extended.theta_rmse < 0.5 * helping.without.theta_rmse
    quiet = replace(
        findings, nameless="no_gap", suspected=("coulomb_friction",),
        posterior=posterior_of(pool, named, started(pool, coulomb_friction=0.6),
                               {frozenset({"coulomb_friction"}): 1.0}, {}),
        criteria={"coulomb_friction": (Criterion(name=OPEN, value=1.0, bar=0.0, passed=False),)},
    )  # fmt: skip
    diagnosis, _ = conclude(
        train, quiet, ideal_model(), test, np.random.default_rng(0), time.monotonic()
    )
    assert diagnosis.verdict == "no_gap"  # the starting model leaves nothing: none is in the file
    assert (*diagnosis.effects, *diagnosis.suspected, *diagnosis.model.effects) == ()
    assert diagnosis.posterior.sets == ()
    worse = replace(findings, nameless="no_gap", predictor=None,
                    criteria={"viscous_friction": ()},
                    final=found_of(pool, started(pool, viscous_friction=30.0)))  # fmt: skip
    diagnosis, _ = conclude(
        train, worse, ideal_model(), test, np.random.default_rng(0), time.monotonic()
    )
    assert diagnosis.verdict == "no_gap"  # it makes no held-out error smaller


def test_a_slow_shaft_of_a_fast_log_is_not_at_rest_within_a_count() -> None:
    """At 1 kHz a count of 1.5 mrad lasts for 15 rows of a shaft that turns 0.1 rad a second."""
    time = np.arange(1000) / 1000.0
    count = 2.0 * np.pi / 4096.0
    angle = count * np.round(0.1 * np.minimum(time, 0.5) / count)
    fast: Any = SimpleNamespace(
        recordings=[SimpleNamespace(time=time, motor_position=angle[:, None])],
        timeline=lambda _: SimpleNamespace(trusted=np.ones(1000, dtype=bool)),
        compared=[{"theta": (0,)}],
    )
    resting = rests(fast)
    assert not resting[50:480].any()
    assert resting[550:].all()


def test_a_smaller_set_goes_on_where_the_larger_ones_derivatives_lead(worlds, monkeypatch) -> None:
    """Its own steps may end early; what is left of two causes that did one thing moves far."""
    pool, names = pool_of(worlds), ("viscous_friction", "coulomb_friction")
    far = started(pool, viscous_friction=0.1, coulomb_friction=3.0)
    (best,) = refit(worlds, [started(pool, viscous_friction=1.0)], pool.floors, iterations=6)
    other = started(pool, coulomb_friction=3.0)
    monkeypatch.setattr(pruning, "look_ahead", lambda *_: [(other, 0.0), (best, 0.0)])
    monkeypatch.setattr(pruning, "refit", lambda _, fits, *__, **___: list(fits))
    assert leave_out(pool, replace_names(far, *names))["coulomb_friction"].score == best.score


def test_a_row_that_jumps_on_one_side_alone_tells_nothing_of_a_number() -> None:
    """One row of stick and slip made an interval of 1 % reach from half to twice a value."""
    smooth, jump, turn = harmonic(
        np.array([2.0, 900.0, 3.0]), np.array([2.2, 2.0, -3.0])
    ).tolist()  # fmt: skip
    assert smooth == pytest.approx(2.1, rel=0.01)
    assert 2.0 < jump < 4.0
    assert turn == 0.0


def test_of_two_forms_of_one_friction_either_begins_with_the_strength_of_both() -> None:
    """With its own part of it alone a form ended at a worse place, and the other took its name."""
    names = ("stribeck_friction", "hysteresis")
    pool = pool_of(SearchWorlds(Study([log(0)], ideal_model(), names, time_step=STEP)))
    fit = started(pool, stribeck_friction=0.2, hysteresis=0.3)
    static = pool.worlds.study.table.columns("stribeck_friction")[1]
    first = pool.worlds.study.table.columns("stribeck_friction")[0]
    kept, values = taking_over(pool, fit, "hysteresis", "stribeck_friction")
    assert kept == ("stribeck_friction",)
    assert values[first] == pytest.approx(0.5, rel=1e-3)
    assert static not in values or values[static] >= values[first]


def test_a_special_case_is_told_however_many_laws_are_better(worlds: SearchWorlds) -> None:
    """Two better rivals hid that plain friction explains as much."""
    study = Study(
        worlds.study.wholes, ideal_model(),
        (*CATALOGUE, "asymmetric_friction", "hysteresis", "tendon_slack"), time_step=STEP,
    )  # fmt: skip
    pool = pool_of(SearchWorlds(study))
    named = replace(started(pool, asymmetric_friction=0.6), score=1.0)
    others = ("stribeck_friction", "hysteresis", "tendon_slack")
    better = [
        replace(started(pool, **{n: 0.6}), score=1.0 + 0.01 * k) for k, n in enumerate(others)
    ]
    plain = replace(started(pool, coulomb_friction=0.6), score=1.08)
    pool.add([named, *better, plain])
    found = [new_name(named, rival) for rival in rivals_of(pool, named, "asymmetric_friction")]
    assert found == ["stribeck_friction", "hysteresis", "coulomb_friction"]
