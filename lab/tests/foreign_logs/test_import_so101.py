"""Logs of an SO-101 arm become one recording per joint and motion."""

import json
from pathlib import Path

import numpy as np
import pytest

from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.cli import main
from tendon_newton.data.dataset import dataset_folders, load_dataset
from tendon_newton.data.model_file import load_model

COUNT = 2.0 * np.pi / 4096.0
ROWS = 500
TIME = 5.0 + 20057.0 * np.arange(ROWS)  # [us]


def write_motion(
    folder: Path, *, stop: float = 10.0, scale: float = 1.0, control: str | None = None
) -> None:
    """Write a made-up motion of two joints; the second meets something solid at -stop [rad]."""
    folder.mkdir(parents=True)
    goal = np.stack([0.3 * np.sin(1.5e-6 * TIME), 0.8 * np.sin(1.5e-6 * TIME)], axis=1)
    angle = scale * COUNT * np.round(np.maximum(goal - 0.01, -stop) / COUNT)
    speed = np.gradient(angle, 1e-6 * TIME, axis=0)
    torque = 0.022814 * np.round(10.0 * np.abs(speed) + 100.0 * np.abs(goal - angle))
    columns = {
        "control": {"positions": goal},
        "state_motor": {"positions": angle, "velocities": speed, "torques": torque},
    }
    (folder / "joint_list.txt").write_text("Base\nWrist\n")
    for name, table in columns.items():
        lines = [",".join(["type", "timestamp", *table])]
        for k in range(ROWS):
            cells = (f'"{json.dumps(values[k].tolist())}"' for values in table.values())
            lines.append(",".join([name.upper(), repr(float(TIME[k])), *cells]))
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    if control is not None:
        (folder / "control.csv").write_text(control)


def test_each_joint_of_each_motion_is_a_recording(tmp_path: Path) -> None:
    """A joint is a dataset; selected by motion, times in seconds, positions as they stand."""
    for motion in ("slow", "fast"):
        write_motion(tmp_path / "logs" / motion)
    words = ["import", "so101", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert main([*words, "--test", "motion=fast"]) == 0
    assert [folder.name for folder in dataset_folders(tmp_path / "out")] == ["Base", "Wrist"]
    loaded = load_dataset(tmp_path / "out" / "Wrist")
    assert [r.name for r in loaded.train] == ["Wrist_slow.csv"]
    (held,) = loaded.test
    assert (held.name, held.bench, held.start) == ("Wrist_fast.csv", "servo", "first_row")
    np.testing.assert_allclose(np.diff(held.time), 0.020057, rtol=1e-6)
    model = load_model(tmp_path / "out" / "Wrist" / "model.toml")
    assert model.actuator.name == "ideal_position"
    (firmware,) = model.effects
    assert firmware.name == "acceleration_limit"
    assert firmware.values["limit"] == pytest.approx(38.96, abs=0.01)


def test_a_joint_that_is_geared_accelerates_less_in_its_own_radians(tmp_path: Path) -> None:
    """Angles logged 2.5 times too small: 39.0 rad/s^2 of the shaft are 15.6 of the joint."""
    write_motion(tmp_path / "logs" / "one", scale=0.4)
    (limit,) = (e.values["limit"] for e in read_so101(tmp_path / "logs").model.effects)
    assert limit == pytest.approx(38.96 * 0.4, rel=1e-3)


def test_what_is_wrong_with_the_logs_is_found(tmp_path: Path) -> None:
    """Equal stamps, a stop, a current without sign."""
    write_motion(tmp_path / "logs" / "one", stop=0.5)
    words = ["import", "so101", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    text = (tmp_path / "out" / "Wrist" / "import.txt").read_text()
    for part in ("same stamps", "its sign was lost", "something solid is in the way"):
        assert part in text
    assert "Wrist_one.csv" in text.split("something solid")[1]


def test_an_angle_that_was_scaled_tells_by_how_much(tmp_path: Path) -> None:
    """Angles 0.4 counts apart are a shaft's that turns 2.5 times as far."""
    write_motion(tmp_path / "logs" / "one", scale=0.4)
    words = ["import", "so101", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    text = (tmp_path / "out" / "Wrist" / "import.txt").read_text()
    assert "a logged radian is 2.50 of the shaft's" in text


@pytest.mark.parametrize(
    ("control", "words"),
    [
        ("type,timestamp,positions\nCONTROL,5,[0.0]\n", "must be a list of 2 numbers"),
        ("type,timestamp\nCONTROL,5\n", "columns positions are missing"),
        ('a,timestamp,positions\nCONTROL,x,"[0.0, 1.0]"\n', "must be a number"),
        ('a,timestamp,positions\nCONTROL,7,"[0.0, 1.0]"\n', "same timestamps"),
    ],
)
def test_a_broken_log_is_one_line_that_says_so(tmp_path, capsys, control, words) -> None:
    """Exit code 2 and a message that names file and fault."""
    write_motion(tmp_path / "logs" / "one", control=control)
    code = main(["import", "so101", str(tmp_path / "logs"), "--out", str(tmp_path / "out")])
    assert code == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


def test_a_folder_without_motions_is_refused(tmp_path: Path, capsys) -> None:
    """The message says what a motion holds."""
    assert main(["import", "so101", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "state_motor.csv" in capsys.readouterr().err
