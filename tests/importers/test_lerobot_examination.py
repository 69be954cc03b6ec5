"""Examination of LeRobotDatasets: what was planted in an arm is told, joint by joint."""

import json
import sys
from math import pi
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from tendon_newton.cli import main
from tendon_newton.data.importers.joint_examination import JointExamination
from tendon_newton.data.importers.lerobot.lerobot_examination import examine_dataset
from tests.bad_input.damage import refusal
from tests.importers.lerobot_files import lists

DEGREE = pi / 180.0
COUNT = 2.0 * pi / 4096.0
RATE, ROWS, SUBSTEPS = 30.0, 900, 40


def servo(command: np.ndarray, delay: float, lag: float, play: float, offset: float) -> np.ndarray:
    """Step a servo finely, one substep after the other; the encoder counts in 4096ths of a turn."""
    step = 1.0 / RATE / SUBSTEPS
    late = np.r_[np.full(round(delay / step), command[0]), np.repeat(command, SUBSTEPS)]
    drive = shaft = command[0]
    seen = []
    for k in range(len(command) * SUBSTEPS):
        if k % SUBSTEPS == 0:
            seen.append(shaft)
        drive += (late[k] - drive) * (1.0 - np.exp(-step / lag))
        shaft = min(max(shaft, drive - play / 2.0), drive + play / 2.0)
    return COUNT * np.round((np.array(seen) + offset) / COUNT)


def teleoperated(rng: np.random.Generator) -> np.ndarray:
    """Make a joint's command: from place to place at several speeds [rad]."""
    instants = np.cumsum(rng.uniform(0.4, 2.0, ROWS))
    return np.interp(np.arange(ROWS) / RATE, instants, rng.uniform(-0.8, 0.8, ROWS))


def write_arm(
    folder: Path,
    joints: dict[str, np.ndarray],
    time: np.ndarray,
    version: str = "v3.0",
    episode: int | np.ndarray = 0,
) -> Path:
    """Write one file; each joint's columns are command and angle, in degrees."""
    (folder / "meta").mkdir(parents=True)
    feature = {"shape": [len(joints)], "names": [f"{name}.pos" for name in joints]}
    features = {"action": feature, "observation.state": feature}
    info = {"codebase_version": version, "fps": RATE, "features": features}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    command, state = (np.stack([pair[:, k] for pair in joints.values()], 1) for k in (0, 1))
    table = {
        "action": lists(command / DEGREE, fixed=True),
        "observation.state": lists(state / DEGREE, fixed=True),
        "timestamp": time,
        "episode_index": np.broadcast_to(episode, len(time)),
    }
    name = "file-000" if version == "v3.0" else "episode_000000"
    path = folder / "data" / "chunk-000" / f"{name}.parquet"
    path.parent.mkdir(parents=True)
    parquet.write_table(pa.table(table), path)
    return folder


def examined(
    folder: Path, position: np.ndarray, command: np.ndarray, time: np.ndarray | None = None
) -> JointExamination:
    """Examine an arm of one joint."""
    time = np.arange(len(command)) / RATE if time is None else time
    write_arm(folder, {"elbow_flex": np.stack([command, position], 1)}, time)
    return only(folder)


def only(folder: Path) -> JointExamination:
    """Examine an arm of one joint, of which all episodes can be read."""
    examination = examine_dataset(folder)
    (joint,) = examination.joints
    return joint


@pytest.mark.parametrize(
    ("delay", "lag", "play", "offset"),
    [(0.033, 0.077, 0.0, 17.0), (0.060, 0.040, 2.0, -1.0), (0.100, 0.020, 6.0, 0.0)],
)
def test_what_was_planted_in_a_joint_is_told(delay, lag, play, offset, tmp_path, rng) -> None:
    """Delay and lag to 5 ms, a sixth of a row; angles to a third of a degree, four counts."""
    command = teleoperated(rng)
    position = servo(command, delay, lag, play * DEGREE, offset * DEGREE)
    joint = examined(tmp_path / "arm", position, command)
    found = joint.following
    assert (found.delay, found.lag) == pytest.approx((delay, lag), abs=0.005)
    assert (found.play, joint.offsets[0]) == pytest.approx(
        (play * DEGREE, offset * DEGREE), abs=DEGREE / 3.0
    )
    assert bool(joint.faults) == (abs(offset) > 5.0 or play > 5.0)


def test_a_sound_joint_passes(tmp_path: Path, rng: np.random.Generator) -> None:
    """As of an SO-101: 90 ms late, 1 degree of play, 2 degrees of sag."""
    command = teleoperated(rng)
    position = servo(command, 0.03, 0.06, 1.0 * DEGREE, 2.0 * DEGREE)
    joint = examined(tmp_path / "arm", position, command)
    assert (joint.faults, joint.dropped, joint.late) == ((), 0, 0)


def test_rows_that_are_missing_or_late_are_counted(tmp_path, rng) -> None:
    """Twelve rows left out, ten stamped half a period late, and no row is both."""
    command = teleoperated(rng)
    position = servo(command, 0.03, 0.06, 0.0, 0.0)
    time = np.arange(ROWS) / RATE
    time[50:150:10] += 0.5 / RATE
    kept = np.setdiff1d(np.arange(ROWS), np.r_[200:206, 300:304, 500, 600])
    joint = examined(tmp_path / "arm", position[kept], command[kept], time[kept])
    assert (joint.dropped, joint.late) == (12, 10)
    assert any("missing" in fault.evidence for fault in joint.faults)


def test_an_angle_that_was_not_read_anew_is_late(tmp_path: Path, rng: np.random.Generator) -> None:
    """The row before again, amid a motion."""
    command = 0.5 * np.sin(np.arange(ROWS) / RATE)
    position = servo(command, 0.03, 0.06, 0.0, 0.0)
    again = np.arange(10, ROWS, 94)  # a period of the sine: where it moves fastest
    position[again] = position[again - 1]
    assert examined(tmp_path / "arm", position, command).late == len(again)


def test_a_joint_that_is_held_fails(tmp_path: Path, rng: np.random.Generator) -> None:
    """It stands for four of thirty seconds while its command goes on; the rest is told as ever."""
    command = teleoperated(rng)
    position = servo(command, 0.03, 0.06, 0.0, 0.0)
    position[400:520] = position[400]
    joint = examined(tmp_path / "arm", position, command)
    assert any("held short of its command" in fault.evidence for fault in joint.faults)
    assert joint.following.delay + joint.following.lag == pytest.approx(0.09, abs=0.01)


def test_a_calibration_that_drifts_is_seen_in_its_episode(tmp_path, rng) -> None:
    """Nine episodes of 100 rows, the last with 12 degrees more; most of them are sound."""
    command = teleoperated(rng)
    position = servo(command, 0.03, 0.06, 0.0, 0.0)
    position[800:] += 12.0 * DEGREE
    time = np.tile(np.arange(100) / RATE, 9)
    joints = {"elbow_flex": np.stack([command, position], 1)}
    folder = write_arm(tmp_path / "arm", joints, time, episode=np.repeat(np.arange(9), 100))
    joint = only(folder)
    assert np.median(joint.offsets) == pytest.approx(0.0, abs=0.2 * DEGREE)
    assert joint.faults[0].evidence.startswith("reads +1")
    assert "in episode_008" in joint.faults[0].evidence


@pytest.mark.parametrize("spread", [0.2, 0.6])  # within the joint's range, and beyond it [rad]
def test_an_episode_that_follows_nothing_is_told_and_the_others_examined(
    spread, tmp_path, rng
) -> None:
    """One of three holds noise: delay and play are those of the other two."""
    command = teleoperated(rng)
    position = servo(command, 0.03, 0.06, 1.0 * DEGREE, 0.0)
    position[600:] = rng.normal(0.0, spread, 300)
    time, episode = np.tile(np.arange(300) / RATE, 3), np.repeat(np.arange(3), 300)
    joints = {"elbow_flex": np.stack([command, position], 1)}
    joint = only(write_arm(tmp_path / "arm", joints, time, episode=episode))
    assert {fault.recording for fault in joint.faults} == {"episode_002.csv"}
    assert joint.following.delay + joint.following.lag == pytest.approx(0.09, abs=0.01)
    assert joint.following.play == pytest.approx(1.0 * DEGREE, abs=0.3 * DEGREE)


def test_what_is_no_goal_of_the_joint_is_said(tmp_path: Path, rng: np.random.Generator) -> None:
    """Where action holds something else, no delay and no play are told as if they were."""
    joint = examined(tmp_path / "arm", teleoperated(rng), teleoperated(rng))
    (fault,) = joint.faults
    assert "action must" in fault.consequence


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_the_verb_examines_all_joints_and_says_what_comes_next(
    version: str, tmp_path: Path, rng: np.random.Generator, capsys: pytest.CaptureFixture[str]
) -> None:
    """One row for each joint; code 1 where one fails; the next command runs as it stands."""
    commands = [teleoperated(rng) for _ in range(2)]
    positions = [servo(u, 0.03, 0.06, 0.0, k * 9.0 * DEGREE) for k, u in enumerate(commands)]
    pairs = [np.stack(pair, 1) for pair in zip(commands, positions, strict=True)]
    joints = dict(zip(("shoulder_pan", "elbow_flex"), pairs, strict=True))
    folder = write_arm(tmp_path / "arm", joints, np.arange(ROWS) / RATE, version)
    assert main(["doctor", str(folder)]) == 1
    said = capsys.readouterr().out
    assert "good  shoulder_pan" in said
    assert "fix   elbow_flex" in said
    assert "1 of 2 joints to mend" in said
    (command,) = (line for line in said.splitlines() if line.startswith("next: tendon-newton "))
    words = command.split()[2:]
    words[words.index("--out") + 1] = str(tmp_path / "out")
    assert main([*words, *["--budget", "1s"] * (words[0] == "diagnose")]) == 0


def test_a_folder_of_joints_names_one_command_for_all(tmp_path, rng, capsys) -> None:
    """A LeRobotDataset is no dataset of ours: what takes it is named, which the import tells too.

    It tells once what all joints have in common. The joints' folder is one diagnosis, to which each
    must bring a recording that no fit sees.
    """
    pair = np.stack([teleoperated(rng)] * 2, 1)
    folder = write_arm(tmp_path / "raw", {"pan": pair, "lift": pair}, np.arange(ROWS) / RATE)
    out, mapping = tmp_path / "arm", tmp_path / "mapping.toml"
    mapping.write_text('bench = "servo"\n[columns]\ntheta = {column = "q"}\n')
    words = ["import", "mapped", str(folder), "--mapping", str(mapping), "--out", str(out)]
    assert f"tendon-newton import lerobot {folder} --out arm" in refusal(words, capsys)
    assert main(["simulate", str(folder), "--model", "m.toml", "--out", str(tmp_path / "x")]) == 2
    assert f"tendon-newton diagnose {folder}" in capsys.readouterr().err
    assert main(["import", "lerobot", str(folder), "--out", str(out), "--unit", "deg"]) == 0
    said = capsys.readouterr().out
    assert said.count("no speed was logged") == 1
    assert f"tendon-newton diagnose {out} --out {out}_diagnosis --hold-out 0.3\n" in said
    assert main(["diagnose", str(out), "--out", str(tmp_path / "x")]) == 2
    assert f'{out / "lift" / "dataset.toml"}: some recording must have split = "test"' in (
        capsys.readouterr().err
    )
    main(["doctor", str(out), "--mend", str(tmp_path / "mended")])
    assert (tmp_path / "mended" / "lift" / "dataset.toml").is_file()
    said = capsys.readouterr().out
    assert all(f"{out / joint}: 1 recordings" in said for joint in ("pan", "lift"))


def sound_arm(folder: Path, rng: np.random.Generator, **spoiled: np.ndarray) -> Path:
    """Write four joints of one episode, some of them with other angles."""
    commands = {name: teleoperated(rng) for name in ("pan", "lift", "elbow", "wrist")}
    positions = {name: servo(u, 0.03, 0.05, 0.5 * DEGREE, 0.0) for name, u in commands.items()}
    positions |= spoiled
    joints = {name: np.stack([commands[name], positions[name]], 1) for name in commands}
    return write_arm(folder, joints, np.arange(ROWS) / RATE)


def test_the_answer_for_programs_is_one_object(tmp_path, rng, capsys) -> None:
    """Findings with check, rows and mend; a file of the dataset stands for its folder."""
    folder = sound_arm(tmp_path / "arm", rng)
    assert main(["doctor", str(folder / "meta" / "info.json"), "--json"]) == 0
    (table,) = json.loads(capsys.readouterr().out)["datasets"]
    assert (table["sound"], table["findings"]) == (True, [])
    joint = table["joints"][0]
    assert (joint["joint"], joint["following"]["delay"]) == ("pan", pytest.approx(0.03, abs=0.01))


def spoiled_arm(folder: Path, rng: np.random.Generator, delay: float, play: float) -> Path:
    """Write four joints of which the elbow is late, or has play [deg]."""
    table = parquet.read_table(next(sound_arm(folder / "sound", rng).rglob("*.parquet")))
    command = np.stack(table["action"].to_numpy())[:, 2] * DEGREE
    position = servo(command, delay, 0.05 if delay < 0.1 else 0.14, play * DEGREE, 0.0)
    return sound_arm(folder / "spoiled", np.random.default_rng(20260101), elbow=position)


@pytest.mark.parametrize(
    ("delay", "play", "said"), [(0.03, 4.0, "deg of play"), (0.14, 0.5, "ms late")]
)
def test_a_joint_is_held_against_its_siblings(delay, play, said, tmp_path, rng) -> None:
    """What would pass alone, 4 deg of play or 190 ms, stands out beside 0.5 deg and 80 ms."""
    spoiled = spoiled_arm(tmp_path, rng, delay, play)
    faults = {joint.joint: joint.faults for joint in examine_dataset(spoiled).joints}
    assert [name for name, found in faults.items() if found] == ["elbow"]
    assert said in faults["elbow"][0].evidence


def test_joints_in_a_folder_each_are_held_against_each_other_too(tmp_path, rng, capsys) -> None:
    """A folder of an arm's joints has the table of the LeRobotDataset that it was made of."""
    spoiled, arm = spoiled_arm(tmp_path, rng, 0.03, 4.0), tmp_path / "arm"
    assert main(["import", "lerobot", str(spoiled), "--out", str(arm), "--unit", "deg"]) == 0
    capsys.readouterr()
    assert main(["doctor", str(spoiled), "--unit", "deg", "--json"]) == 1
    (as_it_came,) = json.loads(capsys.readouterr().out)["datasets"]
    assert main(["doctor", str(arm), "--json"]) == 1
    *alone, table = json.loads(capsys.readouterr().out)["datasets"]
    assert all(one["sound"] for one in alone)
    by_name = {joint["joint"]: joint for joint in as_it_came["joints"]}
    assert {joint["joint"]: joint for joint in table["joints"]} == by_name
    assert main(["doctor", str(arm)]) == 1
    said = capsys.readouterr().out
    assert "4.0 deg of play, siblings 0." in said
    assert "1 of 4 joints to mend" in said


def test_machines_that_were_not_logged_together_are_no_arm(tmp_path, rng, capsys) -> None:
    """Datasets side by side whose clocks differ have nothing to do with each other."""
    spoiled, arm = spoiled_arm(tmp_path, rng, 0.03, 4.0), tmp_path / "arm"
    assert main(["import", "lerobot", str(spoiled), "--out", str(arm), "--unit", "deg"]) == 0
    for joint in ("lift", "elbow"):
        (file,) = (arm / joint).glob("*.csv")
        head, *rows = file.read_text().splitlines()
        later = [f"{float(row.split(',')[0]) + 0.007},{row.partition(',')[2]}" for row in rows]
        file.write_text("\n".join([head, *later]) + "\n")
    capsys.readouterr()
    assert main(["doctor", str(arm)]) == 0
    assert "not held against each other: no joints" in capsys.readouterr().out


def test_a_sag_that_goes_with_the_posture_is_no_play(tmp_path, rng) -> None:
    """A weight that pulls an elbow by up to 6 deg, as shoulder and elbow stand."""
    lift, elbow = teleoperated(rng), teleoperated(rng)
    sag = 6.0 * DEGREE * np.cos(lift + elbow)
    joints = {
        "lift": np.stack([lift, servo(lift, 0.03, 0.05, 0.5 * DEGREE, 0.0)], 1),
        "elbow": np.stack([elbow, servo(elbow - sag, 0.03, 0.05, 0.5 * DEGREE, 0.0)], 1),
    }
    folder = write_arm(tmp_path / "arm", joints, np.arange(ROWS) / RATE)
    _, found = examine_dataset(folder).joints
    assert found.following.play == pytest.approx(0.5 * DEGREE, abs=1.0 * DEGREE)
    assert not [fault for fault in found.faults if "play" in fault.evidence]


def test_a_spring_that_holds_a_joint_back_is_no_play(tmp_path) -> None:
    """A servo that reaches 85 % of its goals sags late, as it moves."""
    time = np.arange(ROWS) / RATE
    goal = 0.5 * np.sin(2.0 * pi * 0.2 * time)
    joint = np.stack([goal, servo(0.85 * goal, 0.03, 0.05, 0.0, 0.0)], 1)
    (found,) = examine_dataset(write_arm(tmp_path / "arm", {"elbow": joint}, time)).joints
    assert found.following.play < 0.3 * DEGREE


def test_one_bad_episode_is_listed_and_the_others_examined(tmp_path, rng, capsys) -> None:
    """A clock that restarts makes one of three no recording; a cut one is told by its frames."""
    command = teleoperated(rng)
    pair = np.stack([command, servo(command, 0.03, 0.05, 0.0, 0.0)], 1)
    time = np.tile(np.arange(300) / RATE, 3)
    time[450:600] -= time[450]
    folder = write_arm(tmp_path / "arm", {"pan": pair}, time, episode=np.repeat(np.arange(3), 300))
    assert main(["doctor", str(folder)]) == 1
    said = capsys.readouterr().out
    assert "episode 1: t must strictly increase; row 150 is 0.000000 s" in said
    assert "good  pan" in said


def test_an_id_of_the_hub_needs_its_package(monkeypatch, capsys) -> None:
    """One line says what to install; a name that is no id is no such folder."""
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert "pip install 'tendon-newton[hub]'" in refusal(["doctor", "somebody/something"], capsys)
    assert "no such folder" in refusal(["doctor", "nowhere"], capsys)
