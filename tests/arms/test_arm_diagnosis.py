"""A folder with a dataset of each joint is an arm: one call names the causes of every servo."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.data.plain_numbers import quantity
from tendon_newton.errors import InvalidDataset, InvalidRecording
from tendon_newton.exports.arms.arm_export import arm_motions
from tendon_newton.workflows.diagnosing_arm import diagnose_arm_into, names_line
from tests.arms import planted_arm
from tests.bad_input.damage import refusal
from tests.doors.logs import ROWS, lerobot, sound
from tests.doors.mistakes import FAILED
from tests.importers.lerobot_files import lists
from tests.made import stated_model
from tests.proposed import proposed
from tests.test_next_commands import failed_runs

FLOOR = -0.02  # m
FREE = -10.0  # m: too far below to be met
LATE = 2  # Rows by which servos hear their commands late


def logs_of_arm(folder: Path, floor: float) -> Path:
    """Write datasets of both joints of the planted arm, and its asset."""
    rng = np.random.default_rng(3)
    planted_arm.planted_mechanism(folder)
    lows = {"high": -0.9, "middle": -0.7, "low": -0.5, "test": -0.6}
    motions = [
        planted_arm.planted_motion(name, rng, low, floor, late=LATE) for name, low in lows.items()
    ]
    told = stated_model("ideal_position")
    for j, joint in enumerate(("shoulder", "elbow")):
        *train, test = (motion.recordings[j] for motion in motions)
        write_dataset(folder / "logs" / joint, train, [test])
        write_model(folder / "logs" / joint / "model.toml", told)
    return folder


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm whose tip rests on a floor."""
    return logs_of_arm(tmp_path_factory.mktemp("arm"), FLOOR)


@pytest.fixture(scope="module")
def free_arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm that meets none: to look for one takes half a minute."""
    return logs_of_arm(tmp_path_factory.mktemp("free_arm"), FREE)


def test_one_call_diagnoses_every_servo_of_an_arm(arm, tmp_path, capsys, monkeypatch) -> None:
    """Signs and floor are told, each joint has its report, and all are simulated together."""
    asset, out = arm / "arm" / "arm.usda", tmp_path / "out"
    words = ["diagnose", str(arm / "logs"), "--arm", str(asset), "--out", str(out)]
    assert main([*words, "--budget", "2s"]) == 0
    printed = capsys.readouterr().out
    assert "servos that count the other way: elbow" in printed
    assert "the tip rests on something" in printed
    fitted = dict(re.findall(r"^  (\w+) +compliance ([\d.]+) rad", printed, re.MULTILINE))
    assert {joint: float(value) for joint, value in fitted.items()} == pytest.approx(
        {"shoulder": planted_arm.COMPLIANCE, "elbow": planted_arm.COMPLIANCE}, rel=0.2
    )
    start = json.loads((out / "shoulder" / "diagnosis.json").read_text())["start"]
    late, row = start["command_delay"]["delay"], planted_arm.ROW
    assert late == pytest.approx(LATE * row, abs=row)
    assert main(["explain", str(out / "shoulder"), "command_delay"]) == 0
    lag = f"command_delay {quantity(late, 's')}"
    assert f"The model that was started from has it: {lag}" in capsys.readouterr().out
    *why, export = proposed(printed)
    assert [main(words) for words in why] == [0, 0]
    monkeypatch.chdir(tmp_path)
    assert main([*export, "--seconds", "1"]) == 0
    table = json.loads((out / "arm.json").read_text())
    assert {name: row["sign"] for name, row in table["joints"].items()} == {
        "shoulder": 1,
        "elbow": -1,
    }
    assert table["floor"] == pytest.approx(FLOOR, abs=0.02)  # m: a zero's 0.05 rad times 0.4 m
    for joint, row in table["joints"].items():
        assert (out / joint / "report.html").is_file()
        unseen = ArmMotion(recordings=load_dataset(arm / "logs" / joint).test)
        told = np.sqrt(np.mean((unseen.angles - unseen.commands) ** 2))
        assert row["plain_rmse"] < 0.1 * told
        assert row["together_rmse"] < 0.8 * told  # a search of seconds may name nothing


def test_causes_that_predict_no_better_than_plain_servos_are_told() -> None:
    """A tenth of the squared error is asked; a joint that stands has none."""
    plain = {"pan": 0.01, "lift": 0.02, "jaw": 0.0}
    (line,) = names_line(plain, {"pan": 0.0096, "lift": 0.0188, "jaw": 0.0})
    assert line.startswith("of pan nothing is to be named")
    assert names_line(plain, {"pan": 0.009, "lift": 0.018, "jaw": 0.0}) == []


def lerobot_arm(folder: Path, arm: Path, count: int) -> Path:
    """Write motions of the planted arm as a LeRobotDataset, an episode each, and its URDF."""
    joints = ("shoulder", "elbow")
    each = [load_dataset(arm / "logs" / joint) for joint in joints]
    runs = list(zip(*((*d.test, *d.train)[:count] for d in each), strict=True))
    feature = {"names": [f"{joint}.pos" for joint in joints], "shape": [2]}
    info = {"codebase_version": "v3.0", "fps": 1.0 / planted_arm.ROW}
    info["features"] = {"action": feature, "observation.state": feature}
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    motions = [ArmMotion(recordings=run) for run in runs]
    rows = {
        "action": lists(np.concatenate([m.commands for m in motions]), fixed=True),
        "observation.state": lists(np.concatenate([m.angles for m in motions]), fixed=True),
        "timestamp": np.concatenate([m.time - m.time[0] for m in motions]),
        "episode_index": np.repeat(np.arange(count), [len(m.time) for m in motions]),
    }
    (folder / "data" / "chunk-000").mkdir(parents=True)
    parquet.write_table(pa.table(rows), folder / "data" / "chunk-000" / "file-000.parquet")
    (folder / "two_rods.urdf").write_text(planted_arm.URDF)
    return folder


@pytest.mark.parametrize("episodes", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_a_lerobot_dataset_becomes_an_arm_in_one_call(
    episodes, free_arm, tmp_path, capsys, monkeypatch
) -> None:
    """From its folder and a URDF to arm.json, and on to MuJoCo by the command that is printed."""
    source = lerobot_arm(tmp_path / "raw", free_arm, episodes)
    words = ["diagnose", str(source), "--arm", str(source / "two_rods.urdf")]
    assert main([*words, "--out", str(tmp_path / "out"), "--budget", "1s"]) == 0
    printed = capsys.readouterr().out
    assert "servos that count the other way: elbow" in printed
    assert re.search(r"\w+, 2 of 2 joints, about \d+ s left for all of them\.", printed)
    assert ("the last 30% of it only report the error" in printed) == (episodes == 1)
    *_, export = proposed(printed)
    assert ("--dataset" in export) == (episodes > 1)
    monkeypatch.chdir(tmp_path)
    assert main([*export, "--seconds", "1"]) == 0


def test_a_lerobot_dataset_is_mended_and_split_as_an_import_does(tmp_path) -> None:
    """Rows that were not read go, and the episodes that are named only report the error."""
    _, source = lerobot(tmp_path, failed_runs())
    asked = ["--test", "episode=0", "--mend"]
    assert main(["diagnose", source, *asked, "--out", str(tmp_path / "a"), "--budget", "1s"]) == 0
    assert main(["import", "lerobot", source, *asked, "--out", str(tmp_path / "b")]) == 0
    pans = [tmp_path / "a" / "recordings" / "pan", tmp_path / "b" / "pan"]
    for file in ("dataset.toml", "pan_episode_000.csv", "pan_episode_001.csv"):
        one, other = (folder / file for folder in pans)
        assert one.read_text() == other.read_text()
    pan = load_dataset(pans[0])
    assert [run.name for run in pan.test] == ["pan_episode_000.csv"]
    assert len(pan.test[0].time) < ROWS - 0.7 * len(FAILED)  # those near the motion are not seen


def test_one_episode_is_cut_in_the_command_that_is_printed_too(
    tmp_path, capsys, monkeypatch
) -> None:
    """What holds the end of the only episode out is asked again with the arm's asset."""
    _, source = lerobot(tmp_path, [sound(0)])
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", source, "--out", "out", "--budget", "1s"]) == 0
    (*_, words) = proposed(capsys.readouterr().out)
    assert words[-4:] == ["--hold-out", "0.3", "--arm", "ASSET"]


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--unit", "deg"), "--unit belongs to a LeRobotDataset"),
        (("--test", "file=a"), 'which recordings of it have split = "test"'),
        (("--mend",), "doctor {} --mend {}_mended"),
    ],
)
def test_what_only_a_lerobot_dataset_takes_is_refused(option, said, arm, tmp_path, capsys) -> None:
    """Other datasets state their units and splits, and another verb mends them."""
    logs = arm / "logs"
    assert main(["diagnose", str(logs), "--out", str(tmp_path / "out"), *option]) == 2
    assert said.format(logs, logs) in capsys.readouterr().err


def test_a_joint_that_was_not_recorded_stands(free_arm, tmp_path, capsys) -> None:
    """An arm without its last servo's logs is diagnosed and exported, and that is said."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "shoulder").symlink_to(free_arm / "logs" / "shoulder")
    words = ["diagnose", str(tmp_path / "logs"), "--arm", str(free_arm / "arm" / "arm.usda")]
    assert main([*words, "--out", str(tmp_path / "out"), "--budget", "1s"]) == 0
    assert "elbow has no dataset: it is taken to stand at 0" in capsys.readouterr().out
    table = json.loads((tmp_path / "out" / "arm.json").read_text())
    assert {name: row["diagnosed"] for name, row in table["joints"].items()} == {
        "shoulder": True,
        "elbow": False,
    }
    assert table["joints"]["elbow"]["together_rmse"] == 0.0
    words = ["export", str(tmp_path / "out"), "--to", "mujoco", "--seconds", "1"]
    words += ["--dataset", str(tmp_path / "logs"), "--out", str(tmp_path / "mujoco")]
    assert main(words) == 0


def test_a_folder_of_joints_is_one_object_for_programs(arm, tmp_path, capsys) -> None:
    """The diagnosis of each joint, none of an arm; what is wrong with a joint's data is told."""
    shutil.copytree(arm / "logs", tmp_path / "logs")
    file = tmp_path / "logs" / "elbow" / "elbow_low.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:200], *lines[260:]]) + "\n")
    words = ["diagnose", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert main([*words, "--json", "--budget", "1s"]) == 0
    printed = capsys.readouterr()
    table = json.loads(printed.out)
    assert table["arm"] is None
    for joint in ("elbow", "shoulder"):
        assert table["joints"][joint] == json.loads(
            (tmp_path / "out" / joint / "diagnosis.json").read_text()
        )
    assert "  elbow: " in printed.err
    assert "  shoulder: " not in printed.err


def test_one_joint_s_answer_is_asked_of_an_arm(arm, tmp_path, capsys) -> None:
    """What takes the answer of one servo says which folders have one, and where there are none."""
    found, logs = tmp_path / "found", str(arm / "logs" / "elbow")
    for joint in ("elbow", "shoulder"):
        shutil.copytree(arm / "logs" / joint, found / joint)
        (found / joint / "diagnosis.json").write_text("{}")
    out = ["--out", str(tmp_path / "out")]
    for words in (
        ["explain", str(found)],
        ["experiment", str(found), "--out", str(tmp_path / "run.csv")],
        ["simulate", logs, "--model", str(found), *out],
        ["diagnose", logs, "--model", str(found), *out],
        ["diagnose", logs, "--against", str(found), *out],
        ["export", str(found), "--to", "usd", *out],
    ):
        assert "elbow, shoulder in it have one each: name one of them" in refusal(words, capsys)
    with pytest.raises(InvalidRecording, match="elbow: an arm has a folder with a dataset of each"):
        arm_motions(Arm(
            mechanism=planted_arm.planted_mechanism(tmp_path), sign=np.ones(2), zero=np.zeros(2),
            gravity=np.array([0.0, 0.0, -9.81]),
        ), arm / "logs" / "elbow")  # fmt: skip


def test_a_budget_ends_at_one_instant_for_all_servos(arm: Path, tmp_path: Path) -> None:
    """What was spent before the searches is theirs no more: a budget that is over leaves none."""
    folders = {joint: arm / "logs" / joint for joint in ("elbow", "shoulder")}
    answer = diagnose_arm_into(
        tmp_path / "out",
        {joint: load_dataset(folder) for joint, folder in folders.items()},
        {joint: load_model(folder / "model.toml") for joint, folder in folders.items()},
        None,
        "",
        progress=lambda _: None,
        until=0.0,
    )
    assert not any(one.finished for one in answer.servos.values())


def test_an_arm_of_other_joints_is_refused(arm, tmp_path, capsys) -> None:
    """With the names that are expected and those that came; so is an arm without its joints."""
    asset = str(arm / "arm" / "arm.usda")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "joint_1").symlink_to(arm / "logs" / "shoulder")
    words = ["--arm", asset, "--out", str(tmp_path / "out")]
    assert main(["diagnose", str(tmp_path / "logs"), *words]) == 2
    told = "of each joint, shoulder, elbow; there are folders joint_1: rename them"
    assert told in capsys.readouterr().err
    assert main(["diagnose", str(arm / "logs" / "elbow"), *words]) == 2
    assert "--arm needs a folder with a dataset of each joint" in capsys.readouterr().err
    assert main(["diagnose", str(arm / "logs"), "--against", str(arm / "logs"), *words]) == 2
    assert "no --arm" in capsys.readouterr().err
    with pytest.raises(InvalidDataset, match=r"such folders: elbow, shoulder\. Name one"):
        load_dataset(arm / "logs")
