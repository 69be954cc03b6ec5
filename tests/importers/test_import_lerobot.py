"""Import of LeRobotDatasets: joints, episodes, units that no file states, files of strangers."""

import json
from math import pi
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from tendon_newton.cli import main
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import load_model
from tests.bad_input.damage import refusal
from tests.importers.lerobot_files import ROWS, lerobot_calibration, lerobot_dataset


def run_import(source: Path, out: Path, *options: str) -> int:
    """Run the command line, with the last episode held out."""
    words = ["import", "lerobot", str(source), "--out", str(out), "--test", "episode=2"]
    return main([*words, *options])


def imported(source: Path, out: Path, joint: str) -> Dataset:
    """Import, and load one joint's dataset."""
    assert run_import(source, out) == 0
    return load_dataset(out / joint)


@pytest.mark.parametrize("fixed", [True, False])
def test_a_joint_comes_back_episode_by_episode(tmp_path: Path, *, fixed: bool) -> None:
    """An episode that goes on in the next file is one recording; command and angle are its own."""
    source = lerobot_dataset(tmp_path / "arm", fixed=fixed)
    loaded = imported(source, tmp_path / "out", "elbow_flex")
    names = [f"elbow_flex_episode_00{k}.csv" for k in range(3)]
    assert [log.name for log in (*loaded.train, *loaded.test)] == names
    time = np.arange(ROWS) / 30.0
    for log in (*loaded.train, *loaded.test):
        assert (log.bench, log.start, log.sample_count) == ("servo", "first_row", ROWS)
        np.testing.assert_allclose(log.time, time, atol=1e-6)  # single precision
        np.testing.assert_allclose(log.motor_position[:, 0], np.sin(time + 1.0), atol=1e-6)
        np.testing.assert_allclose(log.command - log.motor_position, 0.01, atol=1e-6)
    model = load_model(tmp_path / "out" / "elbow_flex" / "model.toml")
    assert model.actuator.name == "ideal_position"
    rows = json.loads((tmp_path / "out" / "elbow_flex" / "import.json").read_text())["recordings"]
    conditions = [{"episode": float(k), "joint": "elbow_flex"} for k in range(3)]
    assert [row["conditions"] for row in rows] == conditions
    assert len({row["sha256"] for row in rows}) == 1


def test_several_joints_become_a_dataset_each(tmp_path: Path, capsys) -> None:
    """A joint in percent of an unknown range is left out, and that is said."""
    source = lerobot_dataset(tmp_path / "arm", scale=60.0)
    assert run_import(source, tmp_path / "out", "--unit", "deg") == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "elbow_flex",
        "shoulder_pan",
    ]
    log = load_dataset(tmp_path / "out" / "shoulder_pan").train[0]
    assert np.abs(log.motor_position).max() == pytest.approx(60.0 * pi / 180.0, rel=1e-3)
    said = capsys.readouterr().out
    assert "gripper: in percent of a range that no file here states" in said
    assert "the stamps are the plan, not a clock's" in said


def test_percent_is_an_angle_by_the_arms_calibration(tmp_path: Path) -> None:
    """-100 to 100 percent, and a gripper's 0 to 100, are the range from 1024 to 2048 counts."""
    source = lerobot_dataset(tmp_path / "arm", scale=60.0)
    calibration = str(lerobot_calibration(tmp_path / "arm.json"))
    options = ("--unit", "percent", "--calibration", calibration)
    assert run_import(source, tmp_path / "out", *options) == 0
    pan, gripper = (
        load_dataset(tmp_path / "out" / name).train[0] for name in ("shoulder_pan", "gripper")
    )
    time = np.arange(ROWS) / 30.0
    np.testing.assert_allclose(pan.motor_position[:, 0], 0.6 * np.sin(time) * pi / 4.0, atol=1e-6)
    np.testing.assert_allclose(gripper.motor_position[:, 0], (0.5 + 0.1 * time) * pi / 2.0, 1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "say --unit deg"),  # 60 may be degrees or percent
        (("--unit", "turn"), "No unit named 'turn'"),
        (("--unit", "percent"), "needs --calibration"),
    ],
)
def test_a_unit_that_cannot_be_is_asked_for(options, said, tmp_path, capsys) -> None:
    """One line each, and nothing is written."""
    source = lerobot_dataset(tmp_path / "arm", scale=60.0)
    assert run_import(source, tmp_path / "out", *options) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_options_of_lerobot_belong_to_it(tmp_path: Path, capsys) -> None:
    """Another format refuses them rather than overlook them."""
    words = ["import", "so101", str(tmp_path), "--out", str(tmp_path / "out"), "--unit", "deg"]
    assert "--unit belongs to the format lerobot" in refusal(words, capsys)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fps": 0}, "fps must be positive"),
        ({"features": {}}, "features must hold 'action'"),
        (
            {"features": {"action": {"names": ["a"]}, "observation.state": {"names": ["b"]}}},
            "a joint must stand in action and in observation.state",
        ),
        (
            {"features": {"action": {"names": ["../a", "../a"]}, "observation.state": {}}},
            "names that differ",
        ),
        (
            {"features": {"action": {"shape": [9]}, "observation.state": {"shape": [9]}}},
            "names more joints than a row has",
        ),
    ],
)
def test_a_broken_description_is_refused(changes: dict, said: str, tmp_path: Path, capsys) -> None:
    """One line names what is wrong with info.json."""
    source = lerobot_dataset(tmp_path / "arm", **changes)
    assert run_import(source, tmp_path / "out") == 2
    assert said in capsys.readouterr().err


def test_a_joints_name_stays_a_files_name(tmp_path: Path) -> None:
    """What would lead out of the folder is a line below."""
    feature = {"names": ["../../escape", "b", "c"], "shape": [3]}
    features = {"action": feature, "observation.state": feature}
    source = lerobot_dataset(tmp_path / "arm", features=features)
    assert run_import(source, tmp_path / "out", "--unit", "deg") == 0
    assert (tmp_path / "out" / "______escape" / "______escape_episode_000.csv").is_file()


def test_a_column_that_is_missing_is_called_that(tmp_path: Path, capsys) -> None:
    """What there is stands beside it."""
    source = lerobot_dataset(tmp_path / "arm")
    parquet.write_table(
        pa.table({"timestamp": [0.0]}), source / "data" / "chunk-000" / "file-000.parquet"
    )
    assert run_import(source, tmp_path / "out") == 2
    assert "columns action, episode_index, observation.state are missing" in capsys.readouterr().err


def test_rows_of_another_length_are_refused(tmp_path: Path, capsys) -> None:
    """A list per row has as many numbers in every row."""
    source = lerobot_dataset(tmp_path / "arm")
    table = {
        "action": [[1.0, 2.0, 3.0], [1.0]],
        "observation.state": [[1.0, 2.0, 3.0], [1.0]],
        "timestamp": [0.0, 0.1],
        "episode_index": [0, 0],
    }
    parquet.write_table(pa.table(table), source / "data" / "chunk-000" / "file-000.parquet")
    assert run_import(source, tmp_path / "out") == 2
    assert "as many" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("rows", "width", "said"),
    [(3_000_000, 1, "at most 2000000 rows"), (100_000, 400, "lists of at most 64 numbers")],
)
def test_a_file_that_unpacks_to_gigabytes_is_refused(rows, width, said, tmp_path, capsys) -> None:
    """A few hundred kilobytes of one repeated number: too many rows, or rows too long."""
    source = lerobot_dataset(tmp_path / "arm")
    flat = pa.array(np.zeros(rows * width, np.float32))
    wide = pa.FixedSizeListArray.from_arrays(flat, width)
    ones = pa.array(np.zeros(rows, np.float32))
    columns = {"timestamp": ones, "episode_index": ones, "action": wide, "observation.state": wide}
    path = source / "data" / "chunk-000" / "file-000.parquet"
    parquet.write_table(pa.table(columns), path, compression="zstd")
    assert path.stat().st_size < 2_000_000
    assert run_import(source, tmp_path / "out") == 2
    assert said in capsys.readouterr().err
