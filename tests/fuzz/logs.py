"""Sound recordings to spoil, and how they are read."""

from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w

from tendon_hardware.deployment.deploy_log import STEP_TOPIC
from tendon_hardware.deployment.deploy_log import read_steps as read_logged_steps
from tendon_hardware.logs.mcap_file import McapFile
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import read_csv, write_csv
from tendon_newton.data.formats.mapped_column import read_topic_mapping
from tendon_newton.data.formats.mcap_file import read_mcap
from tendon_newton.data.importers.mapped import read_mapped
from tests.formats.sessions import write_session
from tests.fuzz.mutations import flip
from tests.importers.logs import ROWS, dataset, recording
from tests.importers.test_import_bags import MAPPING as ROWS_OF_A_BAG
from tests.importers.test_rosbag import MAPPING, Bag

DATASET: dict[str, Any] = {
    "recordings": [
        {
            "file": "train.csv",
            "bench": "finger",
            "split": "train",
            "start": "first_row",
            "bench_overrides": {"mass": [0.012, 0.008], "range": [1.7, 1.4]},
            "actuator_overrides": {"gain": 4.0},
            "load_cell_rate": 20,
        },
        {"file": "test.csv", "bench": "finger", "split": "test"},
    ]
}
WORDS = (
    b"float64",
    b"int32",
    b"uint32",
    b"string",
    b"stamp",
    b"sec",
    b"nanosec",
    b"header",
    b"frame_id",
    b"position",
    b"Time",
    b"Header",
    b"[]",
    b"[3]",
    b"=",
    b"\n",
    b"std_msgs/",
    b"uint8[9]",
    b"builtin_interfaces/Time",
    b"velocity",
    b"name",
)
"""Parts of the definitions of messages, to be put in each other's place."""


def csv_file(folder: Path) -> Path:
    """Write two tendons with every kind of column."""
    theta = recording().motor_position.repeat(2, axis=1)
    made = recording(
        motor_position=theta,
        motor_velocity=theta,
        command=theta,
        force=theta,
        tip=np.zeros((ROWS, 2)),
        voltage=np.full(ROWS, 7.4),
        enabled=np.arange(ROWS) < ROWS - 2,
        extra={"note": np.full(ROWS, "a, b")},
    )
    write_csv(folder / "train.csv", made)
    return folder / "train.csv"


def read_csv_twice(path: Path) -> None:
    """What is read can be written and read again, every number the same."""
    made = read_csv(path, bench="finger")
    write_csv(path.with_name("again.csv"), made)
    again = read_csv(path.with_name("again.csv"), bench="finger")
    for name in ("time", "motor_position", "motor_velocity", "command", "force", "enabled"):
        assert np.array_equal(getattr(made, name), getattr(again, name))
    assert set(made.extra) == set(again.extra)


def dataset_folder(folder: Path) -> Path:
    """Write a dataset of two recordings."""
    dataset(folder)
    (folder / "dataset.toml").write_text(tomli_w.dumps(DATASET))
    return folder / "dataset.toml"


def read_dataset(path: Path) -> None:
    """Whatever it says, the recordings come or the refusal names it or one of them."""
    read = load_dataset(path.parent, require_train=False, require_test=False)
    assert len(read.train) + len(read.test) > 0


def mcap_file(folder: Path) -> Path:
    """Write two seconds of a bench in packed groups."""
    return write_session(folder / "run.mcap")


def plain_mcap_file(folder: Path) -> Path:
    """Write messages as they are, so that a change meets names and definitions."""
    from tendon_hardware.logs import ros_messages as ros

    file = McapFile(folder / "run.mcap", {}, endless=True)
    for k in range(40):
        stamp = 10**18 + k * 12_500_000
        for topic in ("/servo/state", "/servo/command"):
            message = ros.joint_state(stamp, ["a"], [0.1 * k], [8.0], [0.1])
            file.write(topic, ros.JOINT_STATE, stamp, message)
        file.write("/load_cell", ros.WRENCH, stamp, ros.wrench(stamp, "cell", 2.0))
        file.write(STEP_TOPIC, ros.NUMBERS, stamp, ros.numbers([0.0] * 9))
    file.finish({})
    return folder / "run.mcap"


def change_definitions(content: bytes, rng: Random) -> bytes:
    """Put one word of the definitions into another's place, as long as it was, or flip bytes."""
    if rng.random() < 0.3:
        return flip(content, rng)
    for _ in range(rng.randrange(1, 4)):
        word = rng.choice(WORDS)
        places = [k for k in range(len(content)) if content.startswith(word, k)]
        if places:
            place = rng.choice(places)
            other = rng.choice(WORDS).ljust(len(word))[: len(word)]
            content = content[:place] + other + content[place + len(word) :]
    return content


def read_mcap_file(path: Path) -> None:
    """Read a log of the finger."""
    read_mcap(path, bench="finger")


def read_steps(path: Path) -> None:
    """Read what a policy did."""
    assert all(np.isfinite(step.time) for step in read_logged_steps(path))


def topics_file(folder: Path) -> Path:
    """Write a mapping of topics with the log that it is for."""
    Bag(plugin="mcap").write(folder / "bag")
    (folder / "topics.toml").write_text('clock = "log"\n' + MAPPING)
    return folder / "topics.toml"


def read_topics(path: Path) -> None:
    """Read a log by a mapping."""
    mapping = read_topic_mapping(path)
    log = path.parent / "bag" / "bag.mcap"
    read_recording_file(log, bench="finger", name=path.name, mapping=mapping)


def bag_file(folder: Path) -> Path:
    """Write a bag; its database is spoilt."""
    (folder / "mapping.toml").write_text('clock = "log"\n' + MAPPING)
    return Bag().write(folder / "bag") / "bag.db3"


def bag_yaml(folder: Path) -> Path:
    """Write a bag; its description is spoilt."""
    return bag_file(folder).with_name("metadata.yaml")


def read_bag(path: Path) -> None:
    """Read a bag by its folder."""
    mapping = read_topic_mapping(path.parents[1] / "mapping.toml")
    read_recording_file(path.parent, bench="finger", name=path.name, mapping=mapping)


def bag_of_rows(folder: Path) -> Path:
    """Write a folder with a bag, one message for each row, and what `import mapped` makes of it."""
    Bag(plugin="mcap").write(folder / "logs" / "bag_2")
    (folder / "mapping.toml").write_text(ROWS_OF_A_BAG)
    (log,) = (folder / "logs" / "bag_2").glob("*.mcap")
    return log


def bag_mapping(folder: Path) -> Path:
    """Write the same; its mapping is spoilt."""
    return bag_of_rows(folder).parents[2] / "mapping.toml"


def import_bag(path: Path) -> None:
    """Import a folder of bags."""
    folder = next(parent for parent in path.parents if (parent / "mapping.toml").exists())
    read_mapped(folder / "logs", folder / "mapping.toml", lambda _: 0.0125)
