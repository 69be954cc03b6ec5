"""Import of Rhoban/bam's logs: units, and failed reads."""

import json
from math import pi
from pathlib import Path

import numpy as np
import pytest

from lab.tests.foreign_logs.bam_files import bam_log
from tendon_lab.foreign_logs.bam.motors import STS3215
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model


def run_import(source: Path, out: Path, *options: str) -> list[dict]:
    """Import and return the findings that were written."""
    assert main(["import", "bam", str(source), "--out", str(out), *options]) == 0
    return json.loads((out / "import.json").read_text())["findings"]


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two logs at two gains."""
    for kp in (8, 16):
        bam_log(tmp_path / "logs" / f"kp{kp}_sine.json", kp=kp)
    return tmp_path / "logs"


def test_a_log_comes_back_in_our_units(logs: Path, tmp_path: Path) -> None:
    """Command, gain, arm, switch and start stand where the contract says; no load is no column."""
    run_import(logs, tmp_path / "out", "--test", "kp=16")
    loaded = load_dataset(tmp_path / "out")
    (train,), (test,) = loaded.train, loaded.test
    assert (train.bench, train.start, train.force) == ("pendulum", "first_row", None)
    assert train.bench_overrides.given == {"mass": (0.5,), "length": (0.1,)}
    assert train.actuator_overrides["duty_per_rad"] == pytest.approx(8 * STS3215.duty_per_gain)
    assert test.actuator_overrides["duty_per_rad"] == pytest.approx(16 * STS3215.duty_per_gain)
    assert train.enabled.argmin() == 150
    assert train.extra == {}
    np.testing.assert_allclose(train.motor_position[:, 0], 0.5 * np.sin(3.0 * train.time))


def test_an_arm_that_nobody_weighed_is_unknown_where_loads_differ(tmp_path: Path) -> None:
    """Two loads: a tenth of the lighter one to start from. One load: no such number."""
    for name, mass in (("light", 0.5), ("heavy", 0.9), ("held", 0.9)):
        bam_log(tmp_path / "logs" / f"{name}.json", mass=mass)
    run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=held")
    model = load_model(tmp_path / "out" / "model.toml")
    assert model.fit[-1] == "arm_mass"
    assert model.bench_overrides["pendulum"].arm_mass == (0.05,)
    run_import(tmp_path / "logs", tmp_path / "alone", "--test", "mass=0.9")
    assert "arm_mass" not in load_model(tmp_path / "alone" / "model.toml").fit


def test_an_arm_that_was_weighed_counts(tmp_path: Path) -> None:
    """What a log states of its arm stands in the dataset, and is not fitted."""
    for name, mass in (("light", 0.5), ("heavy", 0.9), ("held", 0.9)):
        bam_log(tmp_path / "logs" / f"{name}.json", mass=mass, arm_mass=0.08)
    run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=held")
    log, _ = load_dataset(tmp_path / "out").train
    assert log.bench_overrides.arm_mass == (0.08,)
    assert "arm_mass" not in load_model(tmp_path / "out" / "model.toml").fit


def test_reads_that_failed_are_left_out_and_counted(tmp_path: Path) -> None:
    """A lone register of 0, which is -pi, goes with its row; a supply of 0 V is held."""
    time = np.arange(200) / 100.0
    position, supply = 0.5 * np.sin(3.0 * time), np.full(200, 11.9)
    position[[40, 41, 90]] = -3.1401
    supply[[0, 1, 60]] = (0.0, 25.0, 0.0)
    bam_log(tmp_path / "logs" / "a.json", position=position, input_volts=supply)
    bam_log(tmp_path / "logs" / "b.json")
    findings = run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=b")
    (log,) = load_dataset(tmp_path / "out").train
    assert log.sample_count == 197
    assert np.abs(log.motor_position).max() < 0.6
    assert log.voltage is not None
    np.testing.assert_array_equal(log.voltage, 11.9)
    told = {f["channel"]: f["evidence"] for f in findings if "not read" in f["consequence"]}
    assert told == {"theta": "3 of 200 rows, first row 40", "voltage": "3 of 197 rows, first row 0"}


def test_an_arm_that_swings_through_half_a_turn_keeps_its_rows(tmp_path: Path) -> None:
    """Rows at -pi that the motion leads to are no failed reads."""
    swing = -pi + 0.02 * np.sin(np.arange(200) / 10.0)
    for name in "ab":
        bam_log(tmp_path / "logs" / f"{name}.json", position=swing)
    run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=b")
    assert load_dataset(tmp_path / "out").train[0].sample_count == 200


def test_a_log_without_speed_supply_and_temperature_is_enough(tmp_path: Path) -> None:
    """What was not logged is absent, and the speed is the slope."""
    less = {"speed": None, "load": None, "input_volts": None, "temp": None}
    for name in "ab":
        bam_log(tmp_path / "logs" / f"{name}.json", **less)
    run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=b")
    (log,) = load_dataset(tmp_path / "out").train
    assert (log.voltage, log.temperature) == (None, None)
    inner = slice(1, -1)
    np.testing.assert_allclose(  # of a central difference: omega^3 h^2 A / 6
        log.motor_velocity[inner, 0], 1.5 * np.cos(3.0 * log.time)[inner], atol=3e-4
    )


def test_two_servos_are_two_imports(logs: Path, tmp_path: Path, capsys) -> None:
    """One model cannot be the start of both."""
    bam_log(logs / "mx.json", motor="mx106")
    assert main(["import", "bam", str(logs), "--out", str(tmp_path / "out")]) == 2
    assert "mx.json are of two" in capsys.readouterr().err


def test_a_servo_that_a_current_drives_is_refused(tmp_path: Path, capsys) -> None:
    """Its law is not that of a duty."""
    bam_log(tmp_path / "logs" / "a.json", motor="erob80_100")
    assert main(["import", "bam", str(tmp_path / "logs"), "--out", str(tmp_path / "o")]) == 2
    assert "the motor must be one of" in capsys.readouterr().err


def feetech_log(path: Path, *, limit: float, kp: float = 8.0) -> None:
    """Write a log whose load register follows a goal that moves at a limit [rad/s] at most."""
    time = np.arange(200) / 100.0
    command = np.where(time < 0.5, 0.0, 1.5)
    goal = np.clip(limit * (time - 0.52), 0.0, 1.5)
    position = 0.8 * np.clip(limit * (time - 0.6), 0.0, 1.5)
    counts = np.round((goal - position) * 4096.0 / (2.0 * np.pi))
    duty = np.where(np.abs(counts) > 1, np.sign(counts) * (kp / 4 * (np.abs(counts) - 1) + 16), 0)
    register = np.where(duty > 0, 1024 + np.minimum(duty, 1000), -np.maximum(duty, -1000))
    bam_log(
        path,
        kp=kp,
        goal_position=command,
        position=position,
        speed=np.gradient(position, time),
        torque=register / 100.0,
        torque_enable=np.ones(200),
    )


def test_the_load_register_tells_duty_and_goal(tmp_path: Path) -> None:
    """Bit 10 is the sign; the goal moves at the limit that went into the register."""
    for name in "ab":
        feetech_log(tmp_path / "logs" / f"{name}.json", limit=4.0)
    findings = run_import(tmp_path / "logs", tmp_path / "out", "--test", "file=b")
    (log,) = load_dataset(tmp_path / "out").train
    assert log.extra["duty"].max() > 0.3
    assert log.extra["duty"].min() >= 0.0
    effects = {e.name: e.values for e in load_model(tmp_path / "out" / "model.toml").effects}
    assert effects["command_rate_limit"]["limit"] == pytest.approx(4.0, rel=0.02)
    assert effects["starting_duty"] == {"duty": 0.016}
    assert effects["deadband"]["width"] == pytest.approx(2.0 * np.pi / 4096.0)
    assert any("as if the goal moved at" in f["evidence"] for f in findings)
    assert any(f["channel"] == "load" and "not measured" in f["consequence"] for f in findings)


def test_the_failed_reads_of_real_logs_are_found(shared: Path, tmp_path: Path) -> None:
    """320 logs of an STS3215: 60 rows in 52 files, by what their owners know of them."""
    import tarfile

    with tarfile.open(shared / "data" / "sts3215" / "sts3215.tar.xz") as archive:
        archive.extractall(tmp_path / "raw", filter="data")
    findings = run_import(tmp_path / "raw" / "sts3215", tmp_path / "out", "--test", "part2=kp16")
    rows = [f["evidence"] for f in findings if "left out" in f["consequence"]]
    assert (len(rows), sum(int(row.split()[0]) for row in rows)) == (52, 60)
