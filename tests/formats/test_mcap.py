"""Recordings as MCAP files: what is logged comes back, and damage is survived or named."""

import logging
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.logs import ros_messages as ros
from tendon_newton.data import dataset as datasets
from tendon_newton.data.dataset import load_dataset, process_count, write_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mcap_file import read_session
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording, MissingDependency, TendonNewtonError
from tests.formats.sessions import (
    EPOCH,
    HEALTH,
    Signals,
    write_session,
    write_states,
    write_two_tendons,
)


def read(path: Path) -> Recording:
    """Read a log of the finger."""
    return read_recording_file(path, bench="finger")


def joint(k: int, **changes: object) -> ros.Message:
    """Build one reading of a servo, every 12.5 ms; ``changes`` replace its fields."""
    return ros.joint_state(EPOCH + k * 12_500_000, ["a"], [0.1 * k], [8.0], [0.1]) | changes


def test_what_is_logged_comes_back(tmp_path: Path) -> None:
    """Rows are the servo's readings at their own times, with every bit of their values."""
    log = read(write_session(tmp_path / "run.mcap"))
    assert log.sample_count == 160
    np.testing.assert_allclose(log.time, np.arange(160) / 80.0, rtol=0.0, atol=1e-9)  # stamps: ns
    np.testing.assert_array_equal(log.motor_position[:, 0], np.sin(np.arange(160) / 80.0))
    np.testing.assert_array_equal(log.motor_velocity[:, 0], np.cos(np.arange(160) / 80.0))
    assert log.current is not None
    assert log.voltage is not None
    assert log.temperature is not None
    assert set(log.current) == {0.1}
    assert set(log.voltage) == {HEALTH.voltage}
    assert set(log.temperature) == {HEALTH.temperature}


def test_a_row_has_the_last_command_before_it(tmp_path: Path) -> None:
    """A command is held until the next one; nothing is drawn between two."""
    signals = Signals(theta_d=lambda t: 1.0 if t < 0.99 else 2.0)
    log = read(write_session(tmp_path / "run.mcap", signals=signals))
    assert set(log.command[:80, 0]) == {1.0}
    assert set(log.command[80:, 0]) == {2.0}


def test_a_slow_load_cell_is_drawn_linearly_between_its_readings(tmp_path: Path) -> None:
    """At 20 Hz three rows of four lie on the straight line between two readings."""
    signals = Signals(force=lambda t: 5.0 + 3.0 * (round(20.0 * t) % 2))
    log = read(write_session(tmp_path / "run.mcap", signals=signals))
    triangle = 5.0 + 3.0 * np.abs((np.arange(157) / 4.0 + 1.0) % 2.0 - 1.0)
    # 1e-6: stamps of one nanosecond on slopes of 60 N/s
    np.testing.assert_allclose(log.force[:157, 0], triangle, rtol=0.0, atol=1e-6)
    assert set(log.force[157:, 0]) == {8.0}, "held after the last reading"


def test_rows_without_force_are_left_out_and_told(tmp_path, caplog) -> None:
    """Nothing is drawn through a silence of the load cell: there the recording has a gap."""
    log = read(write_session(tmp_path / "run.mcap", silence=(0.5, 1.0)))
    (gap,) = np.flatnonzero(np.diff(log.time) > 0.02)
    assert log.time[gap] == pytest.approx(0.5, abs=1e-6)
    assert log.time[gap + 1] == pytest.approx(1.0, abs=1e-6)
    assert "39 of 160 rows are left out" in caplog.text


def test_two_tendons_share_the_topics(tmp_path: Path) -> None:
    """One name per tendon gives one column each; load cells are told apart by their frames."""
    log = read(write_two_tendons(tmp_path / "run.mcap"))
    assert log.tendon_count == 2
    assert log.command[0].tolist() == [1.0, 2.0]
    assert log.motor_position[0].tolist() == [0.1, 0.2]
    assert log.force[0].tolist() == [5.0, 6.0]
    assert log.current is None
    assert log.extra["current_1"][0] == 0.4


@pytest.mark.parametrize("effort", [[], [float("nan")]])
def test_a_current_that_is_not_measured_is_absent(tmp_path: Path, effort: list[float]) -> None:
    """An empty or not-a-number effort says that there is none."""
    path = write_states(tmp_path / "run.mcap", [joint(k, effort=effort) for k in range(40)])
    assert read(path).current is None


def test_the_last_metadata_record_holds(tmp_path: Path) -> None:
    """What is written at the end replaces what stands at the front."""
    assert read_session(write_session(tmp_path / "run.mcap"))["rows"] == "160"
    killed = write_session(tmp_path / "killed.mcap", finish=False)
    assert read_session(killed) == {"bench": "finger", "seed": "7"}


def test_a_file_of_a_killed_process_is_read_up_to_its_last_chunk(tmp_path, caplog) -> None:
    """Without an index all but the last 4 kB of messages, 0.3 s here, come back."""
    whole = read(write_session(tmp_path / "whole.mcap", rows=1600))
    killed = read(write_session(tmp_path / "killed.mcap", rows=1600, finish=False))
    assert killed.duration >= whole.duration - 0.3
    count = killed.sample_count
    np.testing.assert_array_equal(killed.motor_position, whole.motor_position[:count])
    assert "the file breaks off" in caplog.text


def outcome(path: Path, whole: Recording) -> str:
    """Read a damaged file and require that all that it gives is what was written."""
    try:
        log = read(path)
    except TendonNewtonError as error:
        return "refused" if "run.mcap" in str(error) else "refused without a name"
    # rows may be missing at the front, and then time counts from a later one
    rows = np.flatnonzero(np.isin(whole.motor_position[:, 0], log.motor_position[:, 0]))
    assert rows.size == log.sample_count
    np.testing.assert_array_equal(log.motor_position, whole.motor_position[rows])
    np.testing.assert_allclose(np.diff(log.time), np.diff(whole.time[rows]), atol=1e-9)
    return "whole" if log.sample_count == whole.sample_count else "in part"


def test_a_file_cut_anywhere_is_read_in_part_or_refused(tmp_path, rng, caplog) -> None:
    """At any byte: what is read is what was written, the more the later it was cut."""
    caplog.set_level(logging.CRITICAL)
    path = write_session(tmp_path / "run.mcap", rows=320)
    data, whole = path.read_bytes(), read(path)
    cuts = sorted({0, 1, 8, 9, len(data) - 1, *rng.integers(0, len(data), 60).tolist()})
    outcomes = []
    for cut in cuts:
        path.write_bytes(data[:cut])
        outcomes.append(outcome(path, whole))
    order = {"refused": 0, "in part": 1, "whole": 2}
    ranks = [order[word] for word in outcomes]
    assert ranks == sorted(ranks)
    assert set(outcomes) == set(order)


def test_flipped_bits_never_change_what_is_read(tmp_path, rng, caplog) -> None:
    """A check sum guards every chunk, so a damaged one is left out and the others stay true."""
    caplog.set_level(logging.CRITICAL)
    path = write_session(tmp_path / "run.mcap", rows=320)
    data, whole = path.read_bytes(), read(path)
    outcomes = []
    for place in rng.integers(0, len(data), 60):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(0, 8))
        path.write_bytes(damaged)
        outcomes.append(outcome(path, whole))
    assert outcomes.count("refused") < 6, "one bit costs a chunk, or what follows a broken length"


@pytest.mark.parametrize("content", [b"", b"t,theta\n0,1\n", b"\x89MCAP0\r\n"])
def test_what_is_no_mcap_file_is_refused(tmp_path: Path, content: bytes) -> None:
    """Neither an empty file nor text nor lone magic bytes give a library's error."""
    (tmp_path / "run.mcap").write_bytes(content)
    with pytest.raises(InvalidRecording, match=r"run\.mcap"):
        read(tmp_path / "run.mcap")


def test_a_missing_topic_is_named_with_those_there(tmp_path: Path) -> None:
    """Another topic's name is answered with the topics and how to map them."""
    path = write_states(tmp_path / "run.mcap", [joint(k) for k in range(40)], topic="/joints")
    said = r"theta comes from topic '/servo/state'.*missing; there are /joints.*JointState.*mapping"
    with pytest.raises(InvalidRecording, match=said):
        read(path)


def test_a_speed_that_is_not_there_is_not_made_up(tmp_path: Path) -> None:
    """JointState without velocity is refused; only a mapping may ask for a derivative."""
    path = write_states(tmp_path / "run.mcap", [joint(k, velocity=[]) for k in range(40)])
    with pytest.raises(InvalidRecording, match=r"theta_dot comes from .*holds no value of it"):
        read(path)


@pytest.mark.parametrize(
    ("position", "said"),
    [
        ([float("nan")], "theta must be finite; row 7"),  # as in a CSV file
        ([0.0, 1.0], "the same number of values; they hold 1 or 2"),  # a servo that comes and goes
    ],
)
def test_a_reading_that_fits_no_table_is_refused(tmp_path: Path, position, said: str) -> None:
    """One that is no number, with its row, and one of another width."""
    messages = [joint(k) for k in range(40)]
    messages[7] = joint(7, position=position)
    with pytest.raises(InvalidRecording, match=said):
        read(write_states(tmp_path / "run.mcap", messages))


def test_readings_out_of_order_are_sorted(tmp_path: Path) -> None:
    """Order is that of the stamps, not of the file."""
    messages = [joint(k) for k in range(40)]
    messages[3], messages[20] = messages[20], messages[3]
    log = read(write_states(tmp_path / "run.mcap", messages))
    np.testing.assert_allclose(log.motor_position[:, 0], 0.1 * np.arange(40))


def test_a_repeated_instant_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Of two readings with one stamp the first stays, and it is told."""
    messages = [joint(k) for k in range(40)]
    messages[5] = joint(4)
    assert read(write_states(tmp_path / "run.mcap", messages)).sample_count == 39
    assert "repeat an instant" in caplog.text


def test_a_dataset_takes_mcap_files(tmp_path: Path) -> None:
    """A listed .mcap file loads; written again as a dataset it is CSV."""
    (tmp_path / "dataset.toml").write_text(
        "".join(
            f'[[recordings]]\nfile = "{split}.mcap"\nbench = "finger"\nsplit = "{split}"\n'
            'start = "first_row"\nload_cell_rate = 20\n\n'
            for split in ("train", "test")
        )
    )
    for split in ("train", "test"):
        write_session(tmp_path / f"{split}.mcap")
    loaded = load_dataset(tmp_path)
    assert loaded.train[0].name == "train.mcap"
    assert loaded.train[0].load_cell_rate == 20.0
    write_dataset(tmp_path / "csv", loaded.train, loaded.test)
    (back,) = load_dataset(tmp_path / "csv").train
    assert back.name == "train.csv"
    np.testing.assert_array_equal(back.motor_position, loaded.train[0].motor_position)


@pytest.mark.parametrize("finish", [True, False])
def test_a_session_states_what_stood_in_the_way(tmp_path: Path, *, finish: bool) -> None:
    """Whole or broken off, a file says that a hand held the finger; without a word nothing did."""
    blocked = write_session(tmp_path / "hand.mcap", rows=1600, finish=finish, obstacle="hand")
    assert read(blocked).obstacle == "hand"
    assert read(write_session(tmp_path / "run.mcap")).obstacle == "free"
    assert read_recording_file(blocked, bench="finger", obstacle="free").obstacle == "free"


def test_an_obstacle_survives_where_the_session_does_not(tmp_path: Path) -> None:
    """Written again as CSV, which has no session, the list of the dataset states it."""
    log = read(write_session(tmp_path / "run.mcap", obstacle="tape_roll"))
    write_dataset(tmp_path / "csv", [log], [replace(log, name="test.mcap", obstacle="free")])
    back = load_dataset(tmp_path / "csv")
    assert [r.obstacle for r in (*back.train, *back.test)] == ["tape_roll", "free"]
    assert (tmp_path / "csv" / "dataset.toml").read_text().count("obstacle") == 1


def test_many_files_are_read_side_by_side(tmp_path, monkeypatch, caplog) -> None:
    """Two processes give the recordings of one, in their order, and what they warn of is told."""
    names = [f"run_{k}.mcap" for k in range(5)]
    for k, name in enumerate(names):
        write_session(tmp_path / name, rows=400 + 80 * k, finish=k != 2, obstacle="hand")
    splits = ["train", "train", "test", "train", "train"]
    (tmp_path / "dataset.toml").write_text(
        "".join(
            f'[[recordings]]\nfile = "{name}"\nbench = "finger"\nsplit = "{split}"\n'
            "actuator_overrides = {duty_per_rad = 1.1}\n\n"
            for name, split in zip(names, splits, strict=True)
        )
    )
    alone = load_dataset(tmp_path, jobs=2)
    assert process_count([tmp_path / name for name in names], 2) == 1  # not worth a process
    monkeypatch.setattr(datasets, "WORTH_A_PROCESS", 1)
    assert process_count([tmp_path / name for name in names], 2) == 2
    assert process_count([tmp_path / name for name in names], 1) == 1
    caplog.clear()
    both = load_dataset(tmp_path, jobs=2)
    assert caplog.text.count("the file breaks off") == 1
    for one, other in zip((*alone.train, *alone.test), (*both.train, *both.test), strict=True):
        assert (one.name, one.obstacle) == (other.name, other.obstacle)
        assert dict(one.actuator_overrides) == dict(other.actuator_overrides)
        np.testing.assert_array_equal(one.motor_position, other.motor_position)
        np.testing.assert_array_equal(one.force, other.force)


def test_a_file_that_another_process_cannot_read_is_named(tmp_path, monkeypatch) -> None:
    """The same refusal as in one process."""
    monkeypatch.setattr(datasets, "WORTH_A_PROCESS", 1)
    for name in ("train.mcap", "test.mcap"):
        write_session(tmp_path / name)
    (tmp_path / "test.mcap").write_bytes(b"no messages here")
    entries = [f'[[recordings]]\nfile = "{s}.mcap"\nbench = "finger"\nsplit = "{s}"\n'
               for s in ("train", "test")]  # fmt: skip
    (tmp_path / "dataset.toml").write_text("".join(entries))
    with pytest.raises(InvalidRecording, match=r"test\.mcap: an MCAP file must begin with"):
        load_dataset(tmp_path, jobs=2)


def test_a_missing_package_is_named_with_its_extra(tmp_path, monkeypatch) -> None:
    """Without mcap a user is told what to install."""
    path = write_session(tmp_path / "run.mcap")
    monkeypatch.setitem(sys.modules, "mcap.stream_reader", None)
    with pytest.raises(MissingDependency, match=r"'mcap'.*pip install 'tendon-newton\[sim\]'"):
        read(path)


def test_our_definitions_are_those_of_ros_2() -> None:
    """Field by field the messages are the ones that ROS 2 Humble defines."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    humble = get_typestore(Stores.ROS2_HUMBLE)
    for kind, definition in ros.DEFINITIONS.items():
        for name, fields in get_types_from_msg(definition, kind).items():
            assert fields == humble.fielddefs[name]


def test_other_readers_read_our_files(tmp_path: Path) -> None:
    """Rosbags, which shares no code with the writer, finds the same values."""
    from rosbags.highlevel import AnyReader

    path = write_session(tmp_path / "run.mcap")
    with AnyReader([path]) as bag:
        found: dict[str, list[Any]] = {
            topic: [bag.deserialize(data, c.msgtype) for c, _, data in bag.messages(connections)]
            for topic, connections in ((t, info.connections) for t, info in bag.topics.items())
        }
    positions = [message.position[0] for message in found["/servo/state"]]
    np.testing.assert_array_equal(positions, np.sin(np.arange(160) / 80.0))
    assert found["/load_cell"][0].header.frame_id == "tendon_0"
    sequence, micros, counts = found["/load_cell/raw"][5].data
    assert (sequence, int(micros) % 2**32, counts) == (20, 4_000_250_000, -1020)
    assert found["/servo/diagnostics"][0].status[0].name == "servo"
