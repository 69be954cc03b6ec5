"""Import of XL330 logs: units, splits and what is found in them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tendon_lab.foreign_logs.bam.motors import XL330
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tests.importers.logs import xl330_log


def run_import(source: Path, out: Path, *options: str) -> list[dict]:
    """Import a folder and return the findings that were written."""
    assert main(["import", "xl330", str(source), "--out", str(out), *options]) == 0
    return json.loads((out / "import.json").read_text())["findings"]


def found(findings: list[dict], channel: str, words: str) -> list[str]:
    """Recordings with a finding about a channel whose evidence holds these words."""
    return [f["recording"] for f in findings if f["channel"] == channel and words in f["evidence"]]


@pytest.fixture
def made_up(tmp_path: Path) -> Path:
    """A folder of made-up logs at two gains."""
    for kp, lag in ((100, 0.0), (200, 0.02)):
        for shape in ("sine", "again"):
            xl330_log(tmp_path / "logs" / f"kp{kp}_{shape}.json", kp=kp, lag=lag)
    return tmp_path / "logs"


def test_the_duty_law_is_the_documented_one() -> None:
    """Duty per radian is kp * (4096 / 2 pi) / (256 * 885)."""
    assert 200.0 * XL330.duty_per_gain == pytest.approx(
        200.0 * 4096.0 / (2.0 * np.pi) / (256.0 * 885.0)
    )


def test_a_made_up_log_comes_back_in_our_units(made_up: Path, tmp_path: Path) -> None:
    """Command, gain, load, switch and start of each recording stand where the contract says."""
    run_import(made_up, tmp_path / "out", "--test", "kp=200")
    loaded = load_dataset(tmp_path / "out")
    assert [log.name for log in loaded.test] == ["kp200_again.csv", "kp200_sine.csv"]
    log = loaded.train[0]
    assert log.bench == "pendulum"
    assert log.start == "first_row"
    assert log.force is None
    assert log.time[0] == 0.0035
    assert log.bench_overrides.given == {"mass": (0.49,), "length": (0.1,)}
    assert log.actuator_overrides["duty_per_rad"] == pytest.approx(100.0 * XL330.duty_per_gain)
    assert log.enabled.argmin() == 500
    duty = log.extra["duty"]
    assert duty.min() < 0.0
    law = 100.0 * XL330.duty_per_gain * (log.command - log.motor_position)[:, 0]
    np.testing.assert_allclose(duty, law, atol=1.0 / 885.0)  # one count of the register


def test_a_wrapped_register_is_found_and_undone(made_up: Path, tmp_path: Path) -> None:
    """Negative duty that was read as unsigned is negative again, and the report says where."""
    xl330_log(made_up / "kp100_signed.json", kp=100, unsigned=False)
    findings = run_import(made_up, tmp_path / "out", "--test", "kp=200")
    wrapped = found(findings, "duty", "unsigned")
    assert "kp100_sine.csv" in wrapped
    assert "kp100_signed.csv" not in wrapped
    signed, again = (
        next(log for log in load_dataset(tmp_path / "out").train if log.name == name)
        for name in ("kp100_signed.csv", "kp100_sine.csv")
    )
    np.testing.assert_array_equal(signed.extra["duty"], again.extra["duty"])


def test_a_late_speed_register_is_found(made_up: Path, tmp_path: Path) -> None:
    """20 ms of lag are reported for the logs that have it and for no other."""
    findings = run_import(made_up, tmp_path / "out", "--test", "kp=200")
    late = [f for f in findings if f["channel"] == "theta_dot"]
    assert [f["recording"] for f in late] == ["kp200_again.csv", "kp200_sine.csv"]
    assert all(f["evidence"].startswith(("19 ms", "20 ms", "21 ms")) for f in late)


def test_a_copy_in_the_test_split_is_found(made_up: Path, tmp_path: Path) -> None:
    """A test log that equals a train log is no held-out data."""
    findings = run_import(made_up, tmp_path / "out", "--test", "trajectory=again")
    assert found(findings, "theta", "equal to kp100_sine.csv of the train split")


def test_all_conditions_must_hold_and_the_rest_is_train(made_up: Path, tmp_path: Path) -> None:
    """``--test kp=200 trajectory=sine`` holds one log out and leaves three."""
    run_import(made_up, tmp_path / "out", "--test", "kp=200", "trajectory=sine")
    loaded = load_dataset(tmp_path / "out")
    assert [log.name for log in loaded.test] == ["kp200_sine.csv"]
    assert len(loaded.train) == 3


def test_train_conditions_leave_the_others_out(made_up: Path, tmp_path: Path) -> None:
    """With ``--train`` a log that neither condition selects is written to no split."""
    options = ("--test", "kp=200", "trajectory=sine", "--train", "kp=100,300", "file=kp100_sine")
    assert main(["import", "xl330", str(made_up), "--out", str(tmp_path / "out"), *options]) == 2
    run_import(made_up, tmp_path / "out", *options[:4], "kp=100", "file=kp100_sine")
    loaded = load_dataset(tmp_path / "out")
    assert [log.name for log in loaded.train] == ["kp100_sine.csv"]
    assert not (tmp_path / "out" / "kp200_again.csv").exists()


def test_the_model_to_start_from_leaves_the_motor_open(made_up: Path, tmp_path: Path) -> None:
    """What the logs do not state is listed in ``fit``."""
    run_import(made_up, tmp_path / "out", "--test", "kp=200")
    model = load_model(tmp_path / "out" / "model.toml")
    assert model.actuator.name == "pwm_servo"
    assert model.fit == ("torque_constant", "resistance", "armature")
    assert model.actuator.values["supply_voltage"] == 7.4


def test_an_import_can_be_repeated(made_up: Path, tmp_path: Path) -> None:
    """The same import into the same folder gives the same bytes."""
    run_import(made_up, tmp_path / "out", "--test", "kp=200")
    files = sorted((tmp_path / "out").iterdir())
    first = [path.read_bytes() for path in files]
    run_import(made_up, tmp_path / "out", "--test", "kp=200")
    assert [path.read_bytes() for path in sorted((tmp_path / "out").iterdir())] == first


def test_what_is_wrong_with_the_real_logs_is_found(shared: Path, tmp_path: Path) -> None:
    """Real logs of four gains: wrapped load, late speed, full duty, warming, no arm."""
    findings = run_import(shared / "data" / "xl330", tmp_path / "out", "--test", "kp=200")
    loaded = load_dataset(tmp_path / "out")
    assert (len(loaded.train), len(loaded.test)) == (12, 4)
    wrapped = found(findings, "duty", "unsigned")
    assert sorted({name.split("_", 1)[1] for name in wrapped}) == [
        "lift_and_drop.csv",
        "sin_sin.csv",
        "sin_time_square.csv",
    ]
    assert len(wrapped) == 12
    late = [f for f in findings if f["channel"] == "theta_dot"]
    assert len(late) >= 10
    assert all(18 <= int(f["evidence"].split()[0]) <= 23 for f in late)
    full = found(findings, "duty", "at the limit of 1")
    assert {name.split("_")[0] for name in full} == {"kp400", "kp800"}
    assert found(findings, "temperature", "goes with duty_per_rad") == ["all"]
    assert found(findings, "mass", "not logged") == ["all"]
    assert [f for f in findings if f["severity"] == "defect"] == []
