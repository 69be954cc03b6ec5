"""Recordings as ROS 2 bags of other programs, with topics and fields mapped by a file."""

import logging
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mapped_column import read_topic_mapping
from tendon_newton.data.recording import Recording
from tendon_newton.errors import (
    InvalidMapping,
    InvalidRecording,
    MissingDependency,
    TendonNewtonError,
)

ROWS = 80
PLUGINS = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}
DEGREE = float(np.pi / 180.0)

MAPPING = """
[columns]
theta = {topic = "/joint_states", field = "position", joints = ["spool"]}
theta_dot = {topic = "/joint_states", field = "velocity", joints = ["spool"]}
theta_d = {topic = "/goal", field = "data[1]", unit = "deg", offset = 0.5}
force = {topic = "/scale", field = "data", scale = 9.80665}
"""
"""Speeds and angles of one of two joints, goals in degrees behind another number, force in kg."""


@dataclass
class Bag:
    """What a foreign program writes."""

    plugin: str = "sqlite3"
    stamped: bool = True
    topics: dict[str, str] = field(
        default_factory=lambda: {"state": "/joint_states", "goal": "/goal", "force": "/scale"}
    )

    def write(self, path: Path) -> Path:
        """Write a second of two joints at 80 Hz, a goal, and a scale at 20 Hz."""
        store = get_typestore(Stores.ROS2_HUMBLE)
        kinds = {
            "state": "sensor_msgs/msg/JointState",
            "goal": "std_msgs/msg/Float64MultiArray",
            "force": "std_msgs/msg/Float64",
        }
        with Writer(path, version=9, storage_plugin=PLUGINS[self.plugin]) as writer:
            connections = {
                what: writer.add_connection(topic, kinds[what], typestore=store)
                for what, topic in self.topics.items()
            }
            for k in range(ROWS):
                for what, message in self.messages(store, k).items():
                    if what in connections and (what != "force" or k % 4 == 0):
                        data = store.serialize_cdr(message, kinds[what])
                        writer.write(connections[what], 10**18 + k * 12_500_000, data)
        return path

    def messages(self, store: Any, k: int) -> dict[str, Any]:
        """Build the messages of one row."""
        types = store.types
        nanoseconds = k * 12_500_000 if self.stamped else 0
        stamp = types["builtin_interfaces/msg/Time"](sec=5, nanosec=nanoseconds)
        layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return {
            "state": types["sensor_msgs/msg/JointState"](
                header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
                name=["wrist", "spool"],
                position=np.array([9.0, 0.01 * k]),
                velocity=np.array([9.0, 0.8]),
                effort=np.array([]),
            ),
            "goal": types["std_msgs/msg/Float64MultiArray"](
                layout=layout, data=np.array([-1.0, 90.0])
            ),
            "force": types["std_msgs/msg/Float64"](data=0.5),
        }


def read(path: Path, mapping: str = MAPPING) -> Recording:
    """Read a bag with a mapping."""
    file = path.parent / "mapping.toml"
    file.write_text(mapping)
    return read_recording_file(
        path, name=path.name, bench="finger", mapping=read_topic_mapping(file)
    )


def check(log: Recording) -> None:
    """Require what the foreign program has written, in our units."""
    assert log.sample_count == ROWS
    np.testing.assert_allclose(log.time, np.arange(ROWS) / 80.0, atol=1e-9)
    np.testing.assert_allclose(log.motor_position[:, 0], 0.01 * np.arange(ROWS))
    np.testing.assert_allclose(log.motor_velocity, 0.8)
    assert log.command is not None
    np.testing.assert_allclose(log.command, 90.0 * DEGREE + 0.5)
    assert log.force is not None
    np.testing.assert_allclose(log.force, 0.5 * 9.80665)


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("plugin", PLUGINS)
def test_a_mapped_bag_is_read(tmp_path: Path, plugin: str, alone: bool) -> None:
    """A folder or its file alone, SQLite or MCAP: joint, index, scale and offset as mapped.

    The goal and the scale have no stamp of their own, so their times of recording count; only the
    joints are stamped, which is why they are on another clock here and all is read by ``log``.
    """
    path = Bag(plugin=plugin).write(tmp_path / "bag")
    if alone:
        (path,) = (file for file in path.iterdir() if file.suffix != ".yaml")
    check(read(path, 'clock = "log"\n' + MAPPING))


def test_a_dataset_names_its_mapping(tmp_path: Path) -> None:
    """``mapping`` in an entry is a path inside the dataset's folder."""
    Bag().write(tmp_path / "bag")
    (tmp_path / "ours.toml").write_text('clock = "log"\n' + MAPPING)
    (tmp_path / "dataset.toml").write_text(
        '[[recordings]]\nfile = "bag"\nbench = "finger"\nsplit = "test"\nmapping = "ours.toml"\n'
    )
    check(load_dataset(tmp_path, require_train=False).test[0])


@pytest.mark.parametrize(
    ("bag", "mapping", "said"),
    [
        pytest.param(
            Bag(topics={"state": "/joint_states", "goal": "/goal"}), MAPPING,
            r"'/scale'.*is missing; there are /goal \(std_msgs", id="a topic that a bag lacks",
        ),
        pytest.param(
            Bag(stamped=False), MAPPING, r'stamps of its 80 messages .* clock = "log"',
            id="stamps that were never set",
        ),
        pytest.param(
            Bag(), 'clock = "log"\n' + MAPPING.replace('unit = "deg"', "scale = 1.0"),
            "theta_d must be in radians", id="goals in degrees without a scale",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_its_mapping_is_refused(tmp_path, bag, mapping, said) -> None:
    """With what is there, or what to write."""
    path = bag.write(tmp_path / "bag")
    with pytest.raises(InvalidRecording, match=said):
        read(path, mapping)


def test_a_bag_without_mapping_must_have_our_topics(tmp_path: Path) -> None:
    """The default mapping is that of our own recordings, and the message says how to give one."""
    path = Bag().write(tmp_path / "bag")
    with pytest.raises(InvalidRecording, match=r"'/servo/state'.*/goal.*a mapping names yours"):
        read_recording_file(path, name="bag", bench="finger")


def test_a_message_of_ones_own_is_read_where_the_bag_defines_it(tmp_path: Path) -> None:
    """Custom messages need no installation: their definition comes along."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    definition = "float32 angle\nfloat32 speed\nfloat32 goal\nfloat32[2] cells\n"
    store.register(get_types_from_msg(definition, "lab_msgs/msg/Bench"))
    path = tmp_path / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/bench", "lab_msgs/msg/Bench", typestore=store)
        for k in range(ROWS):
            message = store.types["lab_msgs/msg/Bench"](
                angle=0.5, speed=0.25, goal=1.0, cells=np.array([0.0, 3.0], dtype=np.float32)
            )
            writer.write(
                connection, k * 12_500_000, store.serialize_cdr(message, "lab_msgs/msg/Bench")
            )
    fields = {"theta": "angle", "theta_dot": "speed", "theta_d": "goal", "force": "cells[1]"}
    mapping = "[columns]\n" + "".join(
        f'{column} = {{topic = "/bench", field = "{name}"}}\n' for column, name in fields.items()
    )
    for file in (path, path / "bag.mcap"):
        log = read(file, mapping)
        assert log.force[0, 0] == 3.0
        assert log.motor_velocity[0, 0] == 0.25


@pytest.mark.parametrize("damage", ["cut", "flip"])
@pytest.mark.parametrize("plugin", PLUGINS)
def test_a_damaged_bag_is_read_or_refused(tmp_path, rng, caplog, plugin, damage) -> None:
    """Whatever bytes are wrong, there is a recording or an error of ours, never a library's."""
    caplog.set_level(logging.CRITICAL)
    path = Bag(plugin=plugin).write(tmp_path / "bag")
    (file,) = (each for each in path.iterdir() if each.suffix != ".yaml")
    data, refusals = file.read_bytes(), []
    for place in rng.integers(0, len(data), 5):
        broken = bytearray(data)
        broken[place] ^= 1 << int(rng.integers(0, 8))
        file.write_bytes(data[:place] if damage == "cut" else broken)
        for target in (path, file):
            try:
                read(target, 'clock = "log"\n' + MAPPING)
            except TendonNewtonError as error:
                refusals.append(str(error))
    assert all(text.startswith("bag") for text in refusals)
    assert refusals or damage == "flip"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "a bag is a folder with metadata.yaml; it has none; .* bag/bag.db3"),
        ("{", "must be a ROS 2 bag that rosbags can read; it says"),
        ("a: 1", "must be a ROS 2 bag that rosbags can read; it says"),
    ],
)
def test_a_broken_description_of_a_bag_is_refused(tmp_path, content, said) -> None:
    """Without metadata.yaml the file in the folder is offered instead."""
    path = Bag().write(tmp_path / "bag")
    (path / "metadata.yaml").unlink()
    if content is not None:
        (path / "metadata.yaml").write_text(content)
    with pytest.raises(InvalidRecording, match=said):
        read(path)


def test_a_missing_package_is_named_with_its_extra(tmp_path, monkeypatch) -> None:
    """Without rosbags a user is told what to install."""
    path = Bag().write(tmp_path / "bag")
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(MissingDependency, match=r"'rosbags'.*pip install 'tendon-newton\[ros\]'"):
        read(path)


def theta(row: str) -> str:
    """Return a mapping whose column theta is the one at fault."""
    return f"[columns]\ntheta = {{{row}}}"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "columns must say topic and field of what a ROS 2 recording holds; none does"),
        ("tehta = 3", r"no key named 'tehta'; known: clock, columns"),
        ('[theta]\ntopic = "/a"', r"theta must stand under \[columns\]; it stands alone"),
        ("columns = 3", "columns must be an object; it is 3. It has one per column of ours"),
        (
            "[columns]\ntehta = {}",
            r"columns: tehta: No column named 'tehta'; did you mean 'theta'. known: current",
        ),
        (
            '[columns]\ntheta_dot = {topic = "/a", field = "b"}',
            "must say where 'theta' comes from; it maps theta_dot",
        ),
        ('[columns]\ntheta = {field = "position"}', r"columns: theta: no key named 'field'"),
        (theta('topic = "/a"'), r"columns: theta: field must be text; it is missing"),
        (theta('topic = "/a", field = "position["'), r"field must be a path .* 'position\["),
        (theta('topic = "/a", field = "p", unit = "N"'), "No unit named 'N'; known: deg"),
        (theta('topic = "/a", field = "p", scale = 0'), "scale must be a number that is not 0"),
        (theta('topic = "/a", field = "p", scale = nan'), "scale must be a finite number"),
        (theta('topic = "/a", field = "p", joints = "a"'), "joints must be a list of names"),
        ('[columns]\nforce = {derive = "theta"}', "can be derived"),
        ("clock = 3\n" + MAPPING, "clock must be text; it is 3"),
        ('clock = "wall"\n' + MAPPING, "clock must be 'header' or 'log'; it is 'wall'"),
    ],
)
def test_a_broken_mapping_is_refused(tmp_path: Path, text: str, said: str) -> None:
    """Every fault of a mapping is named with its place."""
    path = tmp_path / "mapping.toml"
    path.write_text(text)
    with pytest.raises(InvalidMapping, match=said):
        read_topic_mapping(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"data[1]"', '"data[7]"', r"field 'data\[7\]' \(theta_d\).*no such field"),
        ('"data[1]"', '"dada"', r"have no such field; there are data, layout"),
        ('["spool"]', '["elbow"]', "joint 'elbow' is missing; there are wrist, spool"),
        ('"data[1]"', '"layout"', "must hold numbers"),
    ],
)
def test_a_mapping_that_does_not_fit_is_named(tmp_path, old, new, said) -> None:
    """A field or joint that messages lack is answered with what they have."""
    path = Bag().write(tmp_path / "bag")
    with pytest.raises(InvalidRecording, match=said):
        read(path, 'clock = "log"\n' + MAPPING.replace(old, new))


def test_a_csv_file_takes_no_mapping(tmp_path: Path) -> None:
    """A mapping of topics beside a CSV file is a slip that is named."""
    (tmp_path / "run.csv").write_text("t,theta,theta_dot,force\n0,0,0,0\n")
    with pytest.raises(InvalidRecording, match=r"a mapping of topics belongs to an \.mcap file"):
        read(tmp_path / "run.csv")
