"""What moved between two days of a bench is found, measured and told; what did not is silent."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.in_time.changes import (
    Changes,
    Days,
    EarlierDay,
    find_changes,
    meant,
    study_day,
)
from tendon_newton.diagnosis.in_time.changes_report import doubt, headline, sentence
from tendon_newton.diagnosis.in_time.walks import WALKS, walk_of
from tendon_newton.diagnosis.result import Estimate
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import UnknownName
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.effect_bench import commanded
from tests.physics.runs import ideal_model, stairs

ENCODER, CELL = 1.5e-3, 0.02  # Noise of encoder [rad] and load cell [N]
WALKING = ("coulomb_friction", "tendon_slack", "gain_error")
"""What may have moved in these tests: the whole catalogue takes a minute to compile."""
FIRST = ideal_model(coulomb_friction={"force": 0.6})  # The bench on the first day
SLACK = {"length": 0.002}


def log_of(model: Model, seed: int) -> Recording:
    """Return what a finger logs in 12 s of random steps, with noise."""
    rng = np.random.default_rng(seed)
    asked = replace(
        commanded(stairs(rng, 960, 0.4, 2.6, 60), bench="finger"), force=np.zeros((960, 1))
    )
    log = simulated_recording(asked, replay([asked], model, time_step=5e-4)[0])
    return replace(
        log,
        name=f"log_{seed}",
        motor_position=log.motor_position + rng.normal(0.0, ENCODER, log.motor_position.shape),
        force=log.force + rng.normal(0.0, CELL, log.force.shape),
    )


def changes_to(second: Model, *, known: Estimate | None = None) -> Changes:
    """Hold a day against the first one, by its recording or by what a diagnosis said of it."""
    if known is None:
        first = study_day([log_of(FIRST, 1)], FIRST, walks=WALKING, effects=WALKING)
    else:
        first = EarlierDay(model=FIRST, estimates={"coulomb_friction": {"force": known}})
    return find_changes(first, [log_of(second, 2)], walks=WALKING, effects=WALKING)


def test_errors_that_no_number_accounts_for_are_doubted() -> None:
    """Stiff grease, which may not move here: the model errs as it never did on its own day."""
    changes = changes_to(ideal_model(viscous_friction={"coefficient": 8.0}))
    assert "diagnose these recordings" in doubt(changes)
    assert doubt(replace(changes, usual=None)) == ""  # nobody knows how it erred


@pytest.mark.parametrize(
    ("worn", "cause", "truth", "said"),
    [
        (
            ideal_model(coulomb_friction={"force": 0.6}, tendon_slack=SLACK),
            "tendon_slack",
            0.002,
            "The slack has grown by 2.0",
        ),
        (
            ideal_model(coulomb_friction={"force": 0.9}),
            "coulomb_friction",
            0.9,
            "The dry friction has grown by 0.3",
        ),
    ],
)
def test_what_moved_is_found_with_its_size_and_nothing_else(worn, cause, truth, said) -> None:
    """One number moved: it alone is told, its interval holds the truth, its step is in words."""
    changes = changes_to(worn)
    (moved,) = changes.moved
    assert (moved.cause, moved.rivals) == (cause, ())
    assert doubt(changes) == ""
    assert moved.ci95[0] <= truth <= moved.ci95[1]
    assert moved.value == pytest.approx(truth, rel=0.1)  # noise of 12 s
    assert moved.probability > 0.95
    assert all(c.probability < 0.5 for c in changes.numbers if not c.moved)
    assert sentence(moved).startswith(said[:-1])
    assert sentence(moved).endswith(f": {walk_of(cause).mend}.")
    values = {effect.name: effect.values for effect in changes.model.effects}
    assert list(values[cause].values()) == [moved.value]
    assert changes.after.theta_rmse < 0.5 * changes.before.theta_rmse


def test_two_days_of_an_unchanged_bench_are_silent() -> None:
    """Other commands and other noise are no change."""
    changes = changes_to(FIRST)
    assert changes.moved == ()
    assert headline(changes).startswith("Nothing has changed")
    assert {c.cause for c in changes.numbers} == set(WALKING)


def test_what_a_model_lacks_on_both_days_has_not_moved() -> None:
    """A model without slack is given it on the first day, and the second is silent."""
    loose = replace(FIRST, effects=(*FIRST.effects, *ideal_model(tendon_slack=SLACK).effects))
    first = study_day([log_of(loose, 1)], FIRST, walks=WALKING, effects=WALKING)
    changes = find_changes(first, [log_of(loose, 2)], walks=WALKING, effects=WALKING)
    assert changes.moved == ()
    assert {effect.name for effect in changes.model.effects} == {"coulomb_friction", "tendon_slack"}


def test_a_mend_is_measured_whether_it_moved_its_number_or_not() -> None:
    """A string that was tightened has no slack, and grease that helped nothing moved nothing."""
    loose = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack=SLACK)
    first = study_day([log_of(loose, 1)], loose, walks=WALKING, effects=WALKING)
    mended = ("tendon_slack", "coulomb_friction")
    changes = find_changes(first, [log_of(FIRST, 2)], mended=mended, walks=WALKING, effects=WALKING)
    told = {change.cause: change for change in changes.numbers if change.mended}
    assert told.keys() == set(mended)
    assert [change.cause for change in changes.moved] == ["tendon_slack"]
    assert told["tendon_slack"].ci95[0] == 0.0
    assert told["tendon_slack"].value < 0.1 * SLACK["length"]
    assert told["coulomb_friction"].ci95[0] < 0.6 < told["coulomb_friction"].ci95[1]


def test_a_mend_means_the_law_that_the_model_has() -> None:
    """Of every servo, in another form of its friction; what cannot have moved is refused."""
    walks = ["stribeck_friction", "tendon_slack of servo 0", "tendon_slack of servo 1"]
    assert meant("tendon_slack", walks) == walks[1:]
    assert meant("tendon_slack of servo 1", walks) == walks[2:]
    assert meant("coulomb_friction", walks) == walks[:1]
    with pytest.raises(UnknownName, match="mended named 'load_cell_gain'"):
        meant("load_cell_gain", walks)


def test_causes_that_make_up_for_each_other_are_not_all_dropped() -> None:
    """Each of three may have stayed by its interval: what the recordings clearly miss is kept."""

    class Alike(Days):
        def __init__(self, worlds: Any) -> None:
            self.mended, self.first = frozenset[str](), worlds

        def around(self, moved: frozenset[str]) -> Any:
            return SimpleNamespace(holds_before=lambda _: True)

        def fit(self, sets: object, start: object = None) -> None:
            pass

        def worth(self, moved: frozenset[str]) -> float:
            return sum({"spool": 9.0, "slack": 3.0, "offset": 1.0}[name] for name in moved)

    assert Alike("there").sure(frozenset(("slack", "spool", "offset"))) == {"spool"}
    assert Alike("there").sure(frozenset(("slack",))) == frozenset()  # and it is not clear
    assert Alike(None).sure(frozenset(("spool",))) == frozenset()


def test_a_mend_promises_at_four_to_one_that_its_number_moved() -> None:
    """It pays no price for a change either; another number pays the odds against it."""

    class Even(Days):
        def __init__(self) -> None:
            none: Any = None
            self.mended, self.fits = frozenset(("tendon_slack",)), {frozenset(): none}

        def gain(self, moved: frozenset[str]) -> float:
            return 0.0

    days = Even()
    slack, both = frozenset(("tendon_slack",)), frozenset(("tendon_slack", "gain_error"))
    assert np.exp(days.worth(slack)) == pytest.approx(4.0, rel=0.02)
    assert days.worth(slack) - days.worth(both) == pytest.approx(walk_of("gain_error").odds)


def test_an_answer_stands_for_the_recordings_of_its_day() -> None:
    """Friction of 0.9 N moved from a well known 0.6 N, and not from one of 0.2 to 1.0 N."""
    worn = ideal_model(coulomb_friction={"force": 0.9})
    sure = Estimate(value=0.6, ci95=(0.57, 0.63), unit="N")
    (moved,) = changes_to(worn, known=sure).moved
    assert moved.cause == "coulomb_friction"
    assert changes_to(worn, known=replace(sure, ci95=(0.2, 1.0))).moved == ()


def test_an_answer_about_all_servos_is_about_each() -> None:
    """Its interval counts for the number of every servo, unless that has one of its own."""
    shared = Estimate(value=0.6, ci95=(0.5, 0.7), unit="N")
    own = replace(shared, value=0.3)
    numbers = {"coulomb_friction": {"force": shared}, "gain_error of servo 1": {"fraction": own}}
    first = EarlierDay(model=FIRST, estimates=numbers)
    assert first.estimate("coulomb_friction of servo 1", "force") == shared
    assert first.estimate("gain_error of servo 1", "fraction") == own
    assert first.estimate("gain_error of servo 0", "fraction") is None


def test_every_walk_is_an_effect_that_can_be_mended() -> None:
    """Each has words for the page; a friction of another form has those of its family."""
    assert set(WALKS) <= set(EFFECTS)
    assert all(walk.what and walk.words and walk.mend for walk in WALKS.values())
    assert walk_of("stribeck_friction of servo 1") == WALKS["coulomb_friction"]
    assert walk_of("speed_limit").what == "speed limit"
