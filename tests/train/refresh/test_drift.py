"""Wear on a bench that the model fitted: named if it is there, and nothing if it is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.control.operator import SilentOperator
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.in_time.changes_report import write_changes
from tendon_newton.diagnosis.in_time.walks import walk_of
from tendon_newton.errors import InvalidDiagnosis
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tendon_newton.workflows.options import RefreshOptions
from tendon_newton.workflows.refreshing import correct_model, find_drift_in_logs
from tendon_train.refresh.drift import SUSPECTS, find_drift, growth, model_error
from tendon_train.refresh.fit_all_numbers import tune
from tendon_train.refresh.refresh_logs import logs_as_dataset
from tendon_train.refresh.refresh_outcome import (
    AGREES,
    CHANGED,
    WORN,
    Ledger,
    headline,
    judge_drift,
    read_drift,
    told_drift,
    write_page,
)
from tendon_train.refresh.slip import SlipComparison, best_offset, slip_since, taut_from, with_slip
from tests.diagnosis.in_time.test_comparing_days import SLACK, STRETCHY, day
from tests.effect_bench import commanded
from tests.physics.runs import ideal_model, stairs

ENCODER, CELL = 1.5e-3, 0.02  # Noise of encoder [rad] and load cell [N]
FEW = ("coulomb_friction", "tendon_slack", "gain_error")
"""Suspects of these tests: all twelve take half a minute to compile."""
FITTED = ideal_model(coulomb_friction={"force": 0.6})  # The model of the bench when it was new


def log_of(model: Model, seed: int) -> Recording:
    """Return what a bench logs in 12 s of random steps, with noise."""
    rng = np.random.default_rng(seed)
    asked = replace(
        commanded(stairs(rng, 960, 0.4, 2.6, 60), bench="finger"), force=np.zeros((960, 1))
    )
    log = simulated_recording(asked, replay([asked], model, time_step=5e-4)[0])
    assert log.force is not None
    return replace(
        log,
        name=f"log_{seed}",
        motor_position=log.motor_position + rng.normal(0.0, ENCODER, log.motor_position.shape),
        force=log.force + rng.normal(0.0, CELL, log.force.shape),
    )


def dataset_of(model: Model, seed: int) -> Dataset:
    """Return a log, cut."""
    return logs_as_dataset(Path("deployments"), [log_of(model, seed)])


@pytest.mark.parametrize(
    ("worn", "name", "number"),
    [
        (ideal_model(coulomb_friction={"force": 1.2}), "coulomb_friction", 1.2),
        (
            ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.004}),
            "tendon_slack",
            0.004,
        ),
    ],
)
def test_wear_is_named_with_its_size(worn: Model, name: str, number: float) -> None:
    """Friction that doubled is named with its new total, though the model has some already."""
    diagnosis, _ = find_drift(dataset_of(worn, 1), FITTED, suspects=FEW)
    drift = judge_drift(diagnosis)
    assert drift.verdict == WORN
    assert [cause.name for cause in drift.causes] == [name]
    (estimate,) = diagnosis.effects[0].parameters.values()
    assert estimate.value == pytest.approx(number, rel=0.05)  # noise, and steps of 1 ms
    drawn = diagnosis.posterior.sample(500, 0)[
        diagnosis.effects[0].name, *diagnosis.effects[0].parameters
    ]
    assert float(np.median(drawn)) == pytest.approx(number, rel=0.05)
    assert drift.corrected_theta_rmse < 0.3 * drift.theta_rmse
    assert judge_drift(diagnosis, grown=1.25).verdict == AGREES  # it always was so
    assert name.replace("_", " ") in headline(drift)


def test_a_bench_that_still_fits_is_left_alone() -> None:
    """Another log of the same bench: nothing is named, and the error is that of earlier logs."""
    earlier = dataset_of(FITTED, 2)
    now = dataset_of(FITTED, 3)
    diagnosis, _ = find_drift(now, FITTED, suspects=FEW)
    grown = growth(now, earlier, FITTED)
    assert grown == pytest.approx(1.0, abs=0.5)
    drift = judge_drift(diagnosis, model_error(earlier.test, FITTED), grown=grown)
    assert (drift.verdict, drift.causes) == (AGREES, ())
    # the encoder's noise, and that of the first row, which friction keeps
    assert drift.theta_rmse < 2.0 * ENCODER
    assert drift.reference_theta_rmse is not None
    assert drift.reference_theta_rmse < 2.0 * ENCODER
    assert headline(drift) == "The bench still is what its model says."
    changed = judge_drift(diagnosis, grown=2.5)  # earlier logs fitted much better
    assert changed.verdict == CHANGED
    assert "no wear in the list explains it" in headline(changed)
    slipped = judge_drift(diagnosis, grown=1.0, slip=0.4)  # turning says what angles do not
    assert slipped.verdict == WORN
    assert [(cause.name, cause.numbers) for cause in slipped.causes] == [
        ("position_offset", ("angle = 0.4 rad",))
    ]
    # a gear that has run dry looks like a slip the other way
    assert judge_drift(diagnosis, grown=1.0, slip=-0.2).verdict == AGREES


def test_every_suspect_is_an_effect_that_wear_explains() -> None:
    """Each has a sentence for the page."""
    from tendon_newton.effects import find_effect

    assert all(find_effect(name).name == name and walk_of(name).words for name in SUSPECTS)


def test_tuning_finds_the_numbers_of_a_model_from_a_log() -> None:
    """Friction and slack of another unit than the model's, to 5 %."""
    truth = ideal_model(coulomb_friction={"force": 1.1}, tendon_slack={"length": 0.003})
    start = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.001})
    tuned = tune([log_of(truth, 4)], start)
    found = {effect.name: effect.values for effect in tuned.model.effects}
    assert found["coulomb_friction"]["force"] == pytest.approx(1.1, rel=0.05)
    assert found["tendon_slack"]["length"] == pytest.approx(0.003, rel=0.05)
    assert tuned.after < 0.1 * tuned.before
    assert tuned.model.actuator == start.actuator
    again = tune([log_of(truth, 4)], tuned.model)
    assert again.after <= again.before


def test_the_page_stands_alone_and_says_what_is_the_matter(tmp_path: Path) -> None:
    """No link leads out of it; what a ledger kept of a drift comes back the same."""
    from dataclasses import asdict

    worn = ideal_model(coulomb_friction={"force": 1.2})
    diagnosis, _ = find_drift(dataset_of(worn, 1), FITTED, suspects=FEW)
    drift = judge_drift(diagnosis, 0.002, grown=10.0)
    assert read_drift(asdict(drift)) == drift
    write_page(tmp_path / "refresh.html", drift, [], {"logs": "<deployments>"}, None)
    page = (tmp_path / "refresh.html").read_text(encoding="utf-8")
    assert "The bench has drifted from its model: coulomb friction." in page
    alone = headline(judge_drift(diagnosis))
    assert alone.startswith("The bench differs from its model: coulomb friction.")
    assert "--reference" in alone
    assert "a gear that has run dry" in page
    assert "&lt;deployments&gt;" in page
    assert "http" not in page.replace("data:", "")


def test_what_has_changed_is_told_to_a_refresh(tmp_path: Path) -> None:
    """The last day's moved number is the cause and its model the corrected one; no log is read."""
    found = tmp_path / "found"
    found.mkdir()
    write_changes(found, {"monday": day(SLACK), "tuesday": day(SLACK, STRETCHY)}, "sunday")
    write_model(found / "model.toml", FITTED)
    options = RefreshOptions(
        logs=(), model=tmp_path / "old.toml", policy=tmp_path, out=tmp_path, changes=found
    )
    ledger = Ledger(tmp_path / "refresh.json", {})
    drift = find_drift_in_logs(options, ledger, SilentOperator())
    assert (drift.verdict, [cause.name for cause in drift.causes]) == (WORN, ["tendon_compliance"])
    assert drift.causes[0].numbers[0].startswith("The stiffness of the tendon is now")
    correct_model(options, drift, ledger, SilentOperator())
    assert load_model(tmp_path / "model.toml") == FITTED
    write_changes(found, {"monday": day(SLACK)}, "sunday")
    assert told_drift(found).verdict == AGREES
    (found / "changes.json").write_text('{"days": {}}')
    with pytest.raises(InvalidDiagnosis, match="must be an object"):
        told_drift(found)


def offset_of(model: Model) -> float:
    """Return the offset [rad] that a model has."""
    (own,) = (effect.values for effect in model.effects if effect.name == "position_offset")
    return float(own["angle"])


def test_a_tendon_is_taut_above_the_open_finger() -> None:
    """A spool that has slipped by 0.48 rad leaves it loose about as much farther."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.006})
    before = taut_from([log_of(FITTED, 1)], FITTED)
    # the same commands pull less on it, and let the finger open farther, by 0.13 rad
    assert taut_from([log_of(worn, 1)], FITTED) == pytest.approx(before + 0.48, abs=0.15)


@pytest.mark.parametrize("length", [0.0, 0.0025, 0.006])
def test_a_slip_is_found_where_the_tendon_is_taut(length: float) -> None:
    """Loose tendon of some length is an offset of the encoder; the loose rows do not count."""
    loose = {"tendon_slack": {"length": length}} if length else {}
    worn = ideal_model(coulomb_friction={"force": 0.6}, **loose)
    corrected = with_slip([log_of(worn, 1)], FITTED)
    assert offset_of(corrected) == pytest.approx(length / 0.0125, abs=0.01)  # two steps of the grid
    assert corrected.effects[0] == FITTED.effects[0]


def test_an_offset_of_the_model_is_replaced() -> None:
    """What is found is the new total."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.3})
    before = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.1})
    corrected = with_slip([log_of(worn, 2)], before)
    assert [effect.name for effect in corrected.effects] == ["coulomb_friction", "position_offset"]
    assert offset_of(corrected) == pytest.approx(0.3, abs=0.01)  # two steps of the grid


def test_rows_below_the_open_finger_do_not_count() -> None:
    """Two thirds of the rows are loose and agree on no slip; the others say what it is."""
    offset = np.array([0.0, 0.2, 0.4])
    simulated = np.r_[np.full(40, 0.1), np.linspace(0.5, 1.0, 20)]
    measured = np.r_[np.full(40, 0.1), simulated[40:] + 0.4]
    error = measured - (simulated + offset[:, None])
    assert best_offset(SlipComparison(offset=offset, angle=measured, error=error), 0.2) == 2


RADIUS = 0.0125  # Of the spool [m]
SERVO_RATE = 80.0  # Hz


def servo_log(seed: int, slip: float = 0.0) -> Recording:
    """Return a log of a motor behind friction that pulls at a spring, as far as its host asks.

    J dw/dt = k (command - angle) - b w - pull - friction, in the command's unit [rad].
    """
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(-1.5, 4.0, 40), 40)
    angles, angle, rate = [], 0.4, 0.0
    substep = 1.0 / (SERVO_RATE * 20.0)
    for command in asked:
        angles.append(angle)
        for _ in range(20):
            pull = 2.5 * max(0.0, angle - slip - 0.3)
            free = rate + (command - angle - pull - 1.7 * rate) * substep / 0.035
            held = (0.3 + 0.2 * pull) * substep / 0.035
            rate = float(np.sign(free) * max(0.0, abs(free) - held))
            angle += rate * substep
    noise = rng.normal(0.0, 1.0e-3, len(angles))
    log = commanded(asked, bench="finger", row=1.0 / SERVO_RATE)
    return replace(log, motor_position=(np.array(angles) + noise)[:, None])


@pytest.mark.parametrize("slip", [-0.2, 0.0, 0.3, 0.5])
def test_a_slip_is_found_without_any_model(slip: float) -> None:
    """Either way, and none where there is none; 20 mrad are a tenth of a small slip."""
    assert slip_since([servo_log(1)], [servo_log(2, slip)]) == pytest.approx(slip, abs=0.02)


def test_logs_in_which_little_turns_say_nothing() -> None:
    """A finger that was held all the time, and a log without commands."""
    still = replace(servo_log(1), motor_position=np.full((1600, 1), 0.4))
    assert slip_since([servo_log(1)], [still]) is None
    pulled = replace(servo_log(2), command=None, force=np.ones((1600, 1)))
    assert slip_since([servo_log(1)], [pulled]) is None


def test_logs_of_the_new_bench_make_up_for_a_wrong_model() -> None:
    """The model is of another finger altogether; the offset that it had is added to."""
    new, later = servo_log(1), servo_log(2, 0.3)
    before = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.1})
    corrected = with_slip([later], before, [new])
    assert offset_of(corrected) == pytest.approx(0.4, abs=0.02)  # a tenth of a small slip


def test_without_logs_of_the_new_bench_the_model_says_it() -> None:
    """Reference logs that say nothing leave the result as it is without them."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.3 * RADIUS})
    log = log_of(worn, 1)
    still = replace(log, motor_position=np.full_like(log.motor_position, 0.4))
    assert with_slip([log], FITTED, [still]) == with_slip([log], FITTED)
