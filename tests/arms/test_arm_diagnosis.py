"""A folder with a dataset of each joint is an arm: one call names the causes of every servo."""

import json
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tests.arms import planted_arm

FLOOR = -0.02  # m


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Datasets of both joints of the planted arm, and its asset."""
    folder, rng = tmp_path_factory.mktemp("arm"), np.random.default_rng(3)
    planted_arm.planted_mechanism(folder)
    lows = {"high": -0.9, "middle": -0.7, "low": -0.5, "test": -0.6}
    motions = [planted_arm.planted_motion(name, rng, low, FLOOR) for name, low in lows.items()]
    told = Model(actuator=NamedValues(name="ideal_position", values={}))
    for j, joint in enumerate(("shoulder", "elbow")):
        *train, test = (motion.recordings[j] for motion in motions)
        write_dataset(folder / "logs" / joint, train, [test])
        write_model(folder / "logs" / joint / "model.toml", told)
    return folder


def test_one_call_diagnoses_every_servo_of_an_arm(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Signs and floor are told, each joint has its report, and all are simulated together."""
    asset, out = arm / "arm" / "arm.usda", tmp_path / "out"
    words = ["diagnose", str(arm / "logs"), "--arm", str(asset), "--out", str(out)]
    assert main([*words, "--budget", "10s"]) == 0
    printed = capsys.readouterr().out
    assert "servos that count the other way: elbow" in printed
    assert "the tip rests on something" in printed
    table = json.loads((out / "arm.json").read_text())
    assert {name: row["sign"] for name, row in table["joints"].items()} == {
        "shoulder": 1,
        "elbow": -1,
    }
    assert table["floor"] == pytest.approx(FLOOR, abs=0.02)  # m: a zero's 0.05 rad times 0.4 m
    for joint, row in table["joints"].items():
        assert (out / joint / "report.html").is_file()
        assert row["plain_rmse"] < 0.005  # rad: told alone they are off by 0.05 and 0.03
        assert row["together_rmse"] < 0.04  # rad: a search of seconds may name nothing


def test_an_arm_of_other_joints_is_refused(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the names that are expected and those that came; so is an arm without its joints."""
    asset = str(arm / "arm" / "arm.usda")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "shoulder").symlink_to(arm / "logs" / "shoulder")
    words = ["--arm", asset, "--out", str(tmp_path / "out")]
    assert main(["diagnose", str(tmp_path / "logs"), *words]) == 2
    told = "'arm' has shoulder, elbow, there are folders shoulder: rename them"
    assert told in capsys.readouterr().err
    assert main(["diagnose", str(arm / "logs" / "elbow"), *words]) == 2
    assert "--arm needs a folder with a dataset of each joint" in capsys.readouterr().err
