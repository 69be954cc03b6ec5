"""Wear on a bench that the model fitted: named if it is there, and nothing if it is not."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.ledger import Ledger
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.diagnosis.in_time.changes_report import write_changes
from tendon_newton.diagnosis.in_time.walks import walk_of
from tendon_newton.errors import InvalidDiagnosis, InvalidOutput
from tendon_newton.workflows.options import RefreshOptions
from tendon_newton.workflows.refreshing import correct_model, find_drift_in_logs
from tendon_train.refresh.drift import SUSPECTS, find_drift, growth, model_error, tune
from tendon_train.refresh.refresh_logs import logs_as_dataset
from tendon_train.refresh.refresh_outcome import (
    AGREES,
    CHANGED,
    WORN,
    Drift,
    headline,
    judge_drift,
    told_drift,
    write_page,
)
from tests.diagnosis.in_time.test_changes import ENCODER, log_of
from tests.diagnosis.in_time.test_changes import FIRST as FITTED
from tests.diagnosis.in_time.test_changes_report import SLACK, STRETCHY, day
from tests.hardware.silent_operator import SilentOperator
from tests.physics.runs import ideal_model

FEW = ("coulomb_friction", "tendon_slack", "gain_error")
"""Suspects of these tests: all twelve take half a minute to compile."""


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
    ((parameter, estimate),) = diagnosis.effects[0].parameters.items()
    assert estimate.value == pytest.approx(number, rel=0.05)  # noise, and steps of 1 ms
    drawn = diagnosis.posterior.sample(500, 0)[diagnosis.effects[0].name, parameter]
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
    worn = ideal_model(coulomb_friction={"force": 1.2})
    diagnosis, _ = find_drift(dataset_of(worn, 1), FITTED, suspects=FEW)
    drift = judge_drift(diagnosis, 0.002, grown=10.0)
    kept = json.loads(json.dumps(asdict(drift)))
    assert CheckedTable(kept, "refresh.json", InvalidOutput).record(Drift) == drift
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
