"""Models that a reader would try first, and what is written where no cause is sure."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis import diagnose
from tendon_newton.diagnosis.diagnose import conclude
from tendon_newton.diagnosis.findings import Findings, PlainModel
from tendon_newton.diagnosis.search.decide import decision
from tendon_newton.diagnosis.search.decide.decision import Decided, best_predictor
from tendon_newton.diagnosis.search.decide.find_causes import predictor_of
from tendon_newton.diagnosis.search.decide.fitted_sets import found_of
from tendon_newton.diagnosis.search.decide.plain_models import LAWS, PLAIN_MODELS, fit_plain_models
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS, special_cases
from tendon_newton.identification.study import Study
from tests.diagnosis.search.test_sets import STEP, log, pool_of, started
from tests.physics.runs import ideal_model

TRIED = ("coulomb_friction", "viscous_friction", "stribeck_friction", "acceleration_limit")


@pytest.fixture(scope="module")
def pool() -> Pool:
    """The fit without causes of three logs of a servo in grease with dry friction."""
    recordings = [log(n) for n in range(3)]
    pool = pool_of(SearchWorlds(Study(recordings, ideal_model(), TRIED, time_step=STEP)))
    pool.followed = (6, 3)
    pool.add(refit(pool.worlds, [started(pool)], pool.floors, iterations=4))
    return pool


def test_the_best_small_set_is_among_plain_models(pool: Pool) -> None:
    """No list holds it: all sets of three laws at most are looked at."""
    plain = fit_plain_models(pool, TRIED)
    best = min(plain.values(), key=pool.cost)
    assert set(best.names) == {"coulomb_friction", "viscous_friction"}


def test_a_law_explains_no_less_than_its_special_case(pool: Pool) -> None:
    """Stribeck friction begins as the dry friction that it holds."""
    fit_plain_models(pool, TRIED)
    for names, fit in list(pool.fits.items()):
        for law in names & {"stribeck_friction"}:
            for special in special_cases(law):
                less = pool.fits.get(names - {law} | {special})
                assert less is None or fit.score <= less.score + 1.0e-3


def test_plain_models_are_of_a_published_list() -> None:
    """Laws that few have in the list were chosen by looking at errors of real logs."""
    own = {"gear_load_friction", "voltage_sag", "holding_friction", "torque_fade"}
    assert not own & {*LAWS, *(effect for effects in PLAIN_MODELS.values() for effect in effects)}
    assert set(LAWS) <= set(EFFECTS)


def test_a_number_that_a_law_is_without_costs_nothing(pool: Pool) -> None:
    """An acceleration without a limit of speed is one number."""
    limit, speed = pool.worlds.study.table.columns("acceleration_limit")
    starts = [(("acceleration_limit",), {limit: 40.0, speed: own}) for own in (np.inf, 5.0)]
    free, bounded = start_fits(pool.worlds, starts, pool.floors)
    assert (pool.numbers(free), pool.numbers(bounded)) == (1, 2)


def test_where_no_cause_is_sure_the_set_that_predicts_best_is_written(pool: Pool) -> None:
    """It is suspected: the verdict stays that nothing is explained."""
    both = started(pool, coulomb_friction=0.6, viscous_friction=1.2)
    pool.add([both])
    nothing = pool.fits[frozenset()]
    predictor, _ = best_predictor(pool, Decided(fit=nothing))
    assert set(predictor.names) == {"coulomb_friction", "viscous_friction"}
    start = found_of(pool, nothing)
    findings = Findings(
        verdict="unexplained", baseline=start, final=None, closest=start, suspected=(),
        classes={}, candidates=(),
        predictor=predictor_of(pool, Decided(fit=nothing, predictor=predictor), None),
    )  # fmt: skip
    test = Study([log(3)], ideal_model(), TRIED, time_step=STEP, like=pool.worlds.study)
    diagnosis, _ = conclude(
        pool.worlds.study, findings, ideal_model(), test, np.random.default_rng(0), time.monotonic()
    )
    assert diagnosis.verdict == "unexplained"
    assert not diagnosis.effects
    assert {e.name for e in diagnosis.suspected} == {"coulomb_friction", "viscous_friction"}
    assert {e.name for e in diagnosis.model.effects} == {"coulomb_friction", "viscous_friction"}
    assert diagnosis.extended.theta_rmse < 0.5 * diagnosis.baseline.theta_rmse


@pytest.mark.parametrize(
    ("predicts", "worst", "less", "kept"),
    [
        (0.5, -0.5, 0.5, ("predictor", "final")),
        (-0.01, -0.05, 0.05, ("final",)),
        (-0.01, -0.05, 0.5, ()),
        (-0.01, -0.5, 0.05, ()),
    ],
)
def test_what_misses_more_on_test_recordings_is_not_written(
    predicts: float,
    worst: float,
    less: float,
    kept: tuple[str, ...],
    pool: Pool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The set that is only suspected goes first, then names that may matter there, and do harm."""
    found = found_of(pool, pool.fits[frozenset()])
    findings = Findings(
        verdict="explained", baseline=found, final=found, closest=found, suspected=(), classes={},
        candidates=(), predictor=found,
    )  # fmt: skip

    measured = SimpleNamespace(fraction=predicts, before="before", after="after")
    lost = {("before", "after"): (worst, 0.5), ("after", "before"): (-0.5, less)}
    monkeypatch.setattr(diagnose, "measure", lambda *_: measured)
    monkeypatch.setattr(diagnose, "fraction_interval", lambda *errors: lost[errors[:2]])
    study, rng = pool.worlds.study, np.random.default_rng(0)
    written, _ = diagnose.helpful(study, findings, study, rng)
    assert tuple(k for k in ("predictor", "final") if getattr(written, k) is not None) == kept
    assert (diagnose.HARDLY_THERE in written.notes) == (kept == ("final",))


def test_a_published_model_pays_nothing_for_its_numbers(pool: Pool, monkeypatch) -> None:
    """Nobody chose it for what it predicts here; a chosen set pays a nat a number."""
    nothing = pool.fits[frozenset()]
    chosen = started(pool, coulomb_friction=0.6, viscous_friction=1.2)
    pool.add([chosen])
    alone = pool.worlds.rows_alone(nothing.residual, pool.floors)
    gain = 0.5 / alone  # [nat per row], less than one number costs

    def unseen(_: Pool, fit: Fit, until: float = np.inf) -> Array:
        return np.array([1.0 - gain * (frozenset(fit.names) == frozenset(chosen.names))])

    monkeypatch.setattr(Pool, "unseen_terms", unseen)
    label = "Coulomb and viscous friction"
    for plain, best in (({}, nothing), ({label: chosen}, chosen)):
        found, _ = best_predictor(pool, Decided(fit=nothing), plain)
        assert found.names == best.names


def test_what_comes_to_a_published_model_costs_itself_alone(pool, monkeypatch) -> None:
    """Its own causes were not chosen: neither they nor those of the answer are paid for."""
    nothing = pool.fits[frozenset()]
    grown = started(pool, coulomb_friction=0.6, viscous_friction=1.2)
    published = started(pool, viscous_friction=1.2)
    pool.add([published, grown])
    alone = pool.worlds.rows_alone(nothing.residual, pool.floors)
    gains = {1: 0.1 / alone, 2: 1.6 / alone}  # by causes

    def unseen(_: Pool, fit: Fit, until: float = np.inf) -> Array:
        return np.array([1.0 - gains.get(len(fit.names), 0.0)])

    monkeypatch.setattr(Pool, "unseen_terms", unseen)
    monkeypatch.setattr(decision, "PLAIN_MODELS", {"viscous": published.names})
    for plain, best in (({}, nothing), ({"viscous": published}, grown)):
        found, _ = best_predictor(pool, Decided(fit=nothing), plain)
        assert set(found.names) == set(best.names)


def test_explained_is_not_said_where_a_plain_model_halves_what_is_left(pool: Pool) -> None:
    """Viscous friction alone is told; a plain model has dry friction beside it."""
    start, named, both = (
        found_of(pool, started(pool, **values))
        for values in (
            {}, {"viscous_friction": 1.2}, {"viscous_friction": 1.2, "coulomb_friction": 0.6},
        )
    )  # fmt: skip
    plain = PlainModel(name="both", effects=both.effects, values=both.values, held_out=0.0)
    test = Study([log(3)], ideal_model(), TRIED, time_step=STEP, like=pool.worlds.study)
    for beside, verdict in (((), "explained"), ((plain,), "partly_explained")):
        findings = Findings(
            verdict="explained", baseline=start, final=named, closest=named, suspected=(),
            classes={}, candidates=(), criteria={"viscous_friction": ()}, plain=beside,
            predicts=0.0,
        )  # fmt: skip
        diagnosis, _ = conclude(
            pool.worlds.study, findings, ideal_model(), test, np.random.default_rng(0),
            time.monotonic(),
        )  # fmt: skip
        assert diagnosis.verdict == verdict
