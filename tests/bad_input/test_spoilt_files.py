"""Spoilt files of every format that the program reads: each is read, or refused in one error.

None may end in a traceback, take more than 5 s of a core or 1 GB, or make anybody open a file
outside its folder. A failure is named by target and number, by which it is the same in every run.
"""

import ctypes
import json
import os
import resource
import shutil
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import tomli_w
import torch

from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.load_cells.calibration import load_calibration, write_calibration
from tendon_hardware.logs import ros_messages as ros
from tendon_hardware.logs.mcap_file import McapFile
from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.formats.mapped_column import read_topic_mapping
from tendon_newton.data.importers.lerobot import LeRobotUnits, read_lerobot
from tendon_newton.data.importers.mapped import read_mapped
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.next_experiment.open_sets_file import read_open_sets
from tendon_newton.diagnosis.posterior import write_posterior
from tendon_newton.errors import TendonNewtonError
from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tendon_train.policy.runs.curve import curve_table
from tendon_train.policy.runs.policy_checkpoint import load_checkpoint
from tests.bad_input.memory import peak_memory
from tests.bad_input.spoiling import Change, change_cells, change_lines, either, flip, table_changer
from tests.bad_input.test_bad_input_diagnoses import ANSWER, OPEN, SETS
from tests.hardware.deploy.policies import card_of, network, write_onnx, write_torchscript
from tests.hardware.load_cells.test_calibration import fit, points
from tests.importers.lerobot_files import lerobot_dataset
from tests.importers.logs import ROWS, dataset, recording
from tests.importers.test_rosbag import MAPPING as TOPICS
from tests.importers.test_rosbag import Bag
from tests.mechanisms.broken.flat_assets import flat_text
from tests.train.actuator.network_files import written

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_trust")]

FILES = 25  # Spoilt files of each format
HANG = 5.0  # Longest time of a core that a file may take [s]
MEMORY = 1000 << 20  # Most memory that it may take [B]
MESSAGE_LIMIT = 4000
"""Longest message [characters]: some name a path of 1000, and forty names of 80."""
IN_OPEN, NONBLOCK = 0x20, 0o4000

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
MODEL: dict[str, Any] = {
    "bench_overrides": {"finger": {"mass": [0.012, 0.008]}},
    "fit": ["gain"],
    "actuator": {"kind": "ideal", "gain": 4.2, "spool_radius": 0.0125},
    "effects": [
        {"name": "viscous_friction", "coefficient": 1.5},
        {"name": "stribeck_friction", "coulomb_force": 1.0, "static_force": 2.0},
    ],
}
LOG_MAPPING: dict[str, Any] = {
    "bench": "spring_weak",
    "files": "run*",
    "columns": {
        "t": {"column": "time_ms", "unit": "ms"},
        "theta_d": {"column": "goal", "unit": "deg", "sign": -1},
        "theta": {"column": "angle", "unit": "deg", "sign": -1, "offset": 0.1},
        "theta_dot": {"derive": "theta"},
        "force": {"column": "grams", "unit": "g"},
    },
    "model": {"kind": "ideal", "gain": 4.0, "spool_radius": 0.0125},
    "fit": ["gain"],
}
NAMES = ("time_ms", "goal", "angle", "grams")
TIME = np.arange(40) / 100.0
VALUES = np.stack([1e3 * TIME, 33.0 * np.sin(TIME), 30.0 * np.sin(TIME), 100.0 + TIME], axis=1)
JSON_ROWS: list[dict[str, float]] = [dict(zip(NAMES, row, strict=True)) for row in VALUES.tolist()]
MJCF = """<mujoco model="finger">
 <include file="inner.xml"/>
 <default><default class="seen"><geom type="mesh" contype="0" conaffinity="0"/></default></default>
 <asset><mesh name="link" file="link.stl"/><texture name="t" type="2d" file="t.png"/></asset>
 <worldbody><body name="proximal" pos="0 0 0.1"><joint name="knuckle" axis="0 1 0" range="0 97"/>
  <geom type="capsule" size="0.006 0.02" mass="0.012"/><geom class="seen" mesh="link"/>
  <inertial pos="0.02 0 0" mass="0.012" diaginertia="1e-6 1e-6 1e-6"/>
  <site name="tip" pos="0.04 0 0"/>
 </body></worldbody>
</mujoco>
"""
URDF = """<robot name="finger">
 <link name="base"/>
 <link name="proximal">
  <visual><geometry><mesh filename="package://hand/link.stl" scale="1 1 1"/></geometry></visual>
  <inertial><mass value="0.012"/><origin xyz="0.02 0 0"/>
  <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="knuckle" type="revolute"><parent link="base"/><child link="proximal"/>
  <axis xyz="0 1 0"/><limit lower="0" upper="1.7" effort="1" velocity="9"/></joint>
</robot>
"""


WORDS = (
    b"float64 int32 uint32 string stamp sec nanosec header frame_id position velocity name Time "
    b"[] [3] = std_msgs/ uint8[9] builtin_interfaces/Time"
).split()
"""Parts of the definitions of messages."""


@dataclass(frozen=True)
class Target:
    """A format: a sound folder whose file is returned, what spoils that file, what reads it."""

    prepare: Callable[[Path], Path]
    change: Change
    read: Callable[[Path], Any]


def put(name: str, content: str) -> Callable[[Path], Path]:
    """Prepare a folder of one file."""

    def prepare(folder: Path) -> Path:
        (folder / name).write_text(content)
        return folder / name

    return prepare


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
    made = read_recording_file(path, bench="finger")
    write_csv(path.with_name("again.csv"), made)
    again = read_recording_file(path.with_name("again.csv"), bench="finger")
    for name in ("time", "motor_position", "motor_velocity", "command", "force", "enabled"):
        assert np.array_equal(getattr(made, name), getattr(again, name))
    assert set(made.extra) == set(again.extra)


def dataset_folder(folder: Path) -> Path:
    """Write a dataset of two recordings."""
    dataset(folder)
    return put("dataset.toml", tomli_w.dumps(DATASET))(folder)


def read_dataset(path: Path) -> None:
    """Whatever it says, the recordings come or the refusal names it or one of them."""
    read = load_dataset(path.parent, require_train=False, require_test=False)
    assert len(read.train) + len(read.test) > 0


def mcap_file(folder: Path) -> Path:
    """Write messages as they are, so that a change meets names and definitions."""
    file = McapFile(folder / "run.mcap", {}, endless=True)
    for k in range(40):
        stamp = 10**18 + k * 12_500_000
        for topic in ("/servo/state", "/servo/command"):
            message = ros.joint_state(stamp, ["a"], [0.1 * k], [8.0], [0.1])
            file.write(topic, ros.JOINT_STATE, stamp, message)
        file.write("/load_cell", ros.WRENCH, stamp, ros.wrench(stamp, "cell", 2.0))
    file.finish({})
    return folder / "run.mcap"


def change_definitions(content: bytes, rng: Random) -> bytes:
    """Put one word of the definitions of messages into another's place, as long as it was."""
    for _ in range(rng.randrange(1, 4)):
        word, other = rng.choice(WORDS), rng.choice(WORDS)
        place = content.find(word, rng.randrange(len(content)))
        if place >= 0:
            other = other.ljust(len(word))[: len(word)]
            content = content[:place] + other + content[place + len(word) :]
    return content


def bag_file(folder: Path) -> Path:
    """Write a bag; its database is spoilt."""
    put("mapping.toml", 'clock = "log"\n' + TOPICS)(folder)
    return Bag().write(folder / "bag") / "bag.db3"


def read_bag(path: Path) -> None:
    """Read a bag by its folder."""
    mapping = read_topic_mapping(path.parents[1] / "mapping.toml")
    read_recording_file(path.parent, bench="finger", name=path.name, mapping=mapping)


def read_model(path: Path) -> None:
    """What is read can be written and read again, equal."""
    model = load_model(path)
    write_model(path.with_name("again.toml"), model)
    assert load_model(path.with_name("again.toml")) == model


def read_finite_diagnosis(path: Path) -> None:
    """Every number that comes through is finite."""
    made = read_diagnosis(path)
    numbers = [p.value for cause in made.effects for p in cause.parameters.values()]
    assert np.all(np.isfinite([made.wall_time_s, *numbers]))


def open_folder(folder: Path) -> Path:
    """Write a diagnosis that leaves two sets open, with its model."""
    put("model.toml", tomli_w.dumps(MODEL))(folder)
    path = put("diagnosis.json", json.dumps(OPEN))(folder)
    write_posterior(path, SETS)
    return path


def calibration_file(folder: Path) -> Path:
    """Write a calibration."""
    write_calibration(folder / "cell.toml", fit(points()))
    return folder / "cell.toml"


def read_calibration(path: Path) -> None:
    """A calibration that passes is the one that was written."""
    assert load_calibration(path).identifier == fit(points()).identifier


def mapping_file(folder: Path) -> Path:
    """Write a mapping beside a folder with a log."""
    (folder / "logs").mkdir()
    lines = [",".join(NAMES), *(",".join(map(str, row)) for row in VALUES.tolist())]
    put("run_1.csv", "\n".join(lines) + "\n")(folder / "logs")
    return put("mapping.toml", tomli_w.dumps(LOG_MAPPING))(folder)


def mapped_csv(folder: Path) -> Path:
    """Write a CSV log that a mapping explains."""
    return mapping_file(folder).parent / "logs" / "run_1.csv"


def mapped_json(folder: Path) -> Path:
    """Write a JSON log that a mapping explains."""
    mapped_csv(folder).unlink()
    return put("run_1.json", json.dumps(JSON_ROWS))(folder / "logs")


def read_mapped_folder(path: Path) -> None:
    """Read a folder of logs by its mapping, of which one is spoilt."""
    folder = next(parent for parent in path.parents if (parent / "logs").exists())
    read_mapped(folder / "logs", folder / "mapping.toml", lambda _: 0.0125)


def lerobot_rows(folder: Path) -> Path:
    """Write a LeRobotDataset and return its first file of rows."""
    return lerobot_dataset(folder / "arm") / "data" / "chunk-000" / "file-000.parquet"


def lerobot_info(folder: Path) -> Path:
    """Write a LeRobotDataset and return what describes it."""
    return lerobot_dataset(folder / "arm") / "meta" / "info.json"


def read_lerobot_folder(path: Path) -> None:
    """Read a LeRobotDataset of which a file is spoilt."""
    read_lerobot(
        next(parent for parent in path.parents if parent.name == "arm"),
        units=LeRobotUnits(unit="deg"),
    )


def change_json(content: bytes, rng: Random) -> bytes:
    """Change a value of a JSON file, or its text."""
    return table_changer(json.loads(content), json.dumps)(content, rng)


def binary_asset(folder: Path) -> Path:
    """Write the finger in USD's binary form."""
    open_stage(asset_path("finger")).Flatten().Export(str(folder / "finger.usdc"))
    return folder / "finger.usdc"


def read_asset(path: Path) -> None:
    """Check an asset, and load it if nothing is wrong."""
    if not any(finding.severity == "error" for finding in check_asset(path)):
        load_mechanism(path)


def mjcf_file(folder: Path) -> Path:
    """Write a finger of MuJoCo."""
    put("inner.xml", "<mujocoinclude/>")(folder)
    return put("finger.xml", MJCF)(folder)


def read_import(path: Path) -> None:
    """Import as an arm, with a tip in the last link, and load what was written."""
    finger = read_foreign(path)
    plan = plan_foreign("mine", finger, tip=(0.04, 0.0, 0.0), spool_radius=0.01, force_limit=3.0)
    load_mechanism(write_foreign(path.parent / "made", plan))


def flip_head(content: bytes, rng: Random) -> bytes:
    """Flip bytes, most often in the head, which names and measures the weights."""
    cut = 8 + int.from_bytes(content[:8], "little") if rng.random() < 0.8 else len(content)
    return flip(content[:cut], rng) + content[cut:]


def flip_back(content: bytes, rng: Random) -> bytes:
    """Flip bytes, half of the time at the end, where nodes, names and metadata stand."""
    cut = len(content) - 4000 if rng.random() < 0.5 else 0
    return content[:cut] + flip(content[cut:], rng)


def read_policy(path: Path) -> None:
    """A policy that is taken gives numbers."""
    policy = load_policy(path, trust=True)
    observation = np.zeros((1, policy.card.observation_size), dtype=np.float32)
    assert np.isfinite(policy(observation)).all()


class Learner:
    """What of rsl-rl's algorithm a checkpoint meets."""

    def __init__(self) -> None:
        self.actor = network()

    def load(self, table: dict[str, Any], parts: Any, strict: bool) -> None:
        """Take the actor's weights."""
        self.actor.load_state_dict(table["actor_state_dict"], strict=strict)


def checkpoint(folder: Path) -> Path:
    """Write a checkpoint of a policy's training."""
    kept = {"actor_state_dict": network().state_dict()}
    table = {"settings": {}, "curve": curve_table(()), "algorithm": kept}
    torch.save(table, folder / "000001.pt")
    return folder / "000001.pt"


def read_checkpoint(path: Path) -> None:
    """A training goes on from it."""
    load_checkpoint(path.parent, {}, Learner(), "cpu")


TEXT = either(change_lines, flip)
TABLE = either(change_cells, change_cells, change_lines, flip)
TARGETS: dict[str, Target] = {
    "csv": Target(csv_file, TABLE, read_csv_twice),
    "dataset": Target(dataset_folder, table_changer(DATASET, tomli_w.dumps), read_dataset),
    "mcap": Target(mcap_file, flip, lambda path: read_recording_file(path, bench="finger")),
    "mcap-schema": Target(
        mcap_file, change_definitions, lambda path: read_recording_file(path, bench="finger")
    ),
    "bag": Target(bag_file, flip, read_bag),
    "bag-yaml": Target(lambda at: bag_file(at).with_name("metadata.yaml"), TEXT, read_bag),
    "model": Target(
        put("model.toml", tomli_w.dumps(MODEL)), table_changer(MODEL, tomli_w.dumps), read_model
    ),
    "diagnosis": Target(
        put("diagnosis.json", json.dumps(ANSWER)), change_json, read_finite_diagnosis
    ),
    "class": Target(open_folder, change_json, lambda path: read_open_sets(path.parent)),
    "calibration": Target(calibration_file, TEXT, read_calibration),
    "mapped-csv": Target(mapped_csv, TABLE, read_mapped_folder),
    "mapped-json": Target(mapped_json, change_json, read_mapped_folder),
    "mapping": Target(
        mapping_file,
        table_changer(LOG_MAPPING, tomli_w.dumps),
        lambda path: read_mapped_folder(path.parent / "logs" / "."),
    ),
    "lerobot": Target(lerobot_rows, flip, read_lerobot_folder),
    "lerobot-info": Target(lerobot_info, change_json, read_lerobot_folder),
    "usda": Target(put("finger.usda", flat_text("finger")), TEXT, read_asset),
    "usdc": Target(binary_asset, flip, read_asset),
    "mjcf": Target(mjcf_file, TEXT, read_import),
    "urdf": Target(put("finger.urdf", URDF), TEXT, read_import),
    "policy-onnx": Target(
        lambda at: write_onnx(at / "policy.onnx", network(), card_of().to_json()),
        flip_back,
        read_policy,
    ),
    "policy-pt": Target(
        lambda at: write_torchscript(at / "policy.pt", network(), card_of().to_json()),
        flip,
        read_policy,
    ),
    "force-weights": Target(
        lambda at: written(at / "force.safetensors"),
        flip_head,
        lambda path: load_network(path, trust=True),
    ),
    "checkpoint": Target(checkpoint, flip, read_checkpoint),
}


class Canary:
    """A file outside every spoilt folder, and a watch on who opens it, libraries included."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        path = folder / "secret.txt"
        path.write_text("canary,canary\n1,2\n")
        system = ctypes.CDLL(None, use_errno=True)
        self._watch = system.inotify_init1(NONBLOCK)
        assert self._watch >= 0
        assert system.inotify_add_watch(self._watch, os.fsencode(path), IN_OPEN) >= 0

    def was_opened(self) -> bool:
        """Say whether anybody has opened it since the last time."""
        try:
            return bool(os.read(self._watch, 1 << 16))
        except BlockingIOError:
            return False


def core_time() -> float:
    """Return how long this process and its children have used a core [s]."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def what_came(target: Target, path: Path) -> tuple[str, str]:
    """Read a file; return "read" or "refused", with what the refusal said."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a changed weight may overflow
        try:
            target.read(path)
        except TendonNewtonError as error:
            return "refused", str(error)
    return "read", ""


@pytest.mark.parametrize("name", TARGETS)
def test_spoilt_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    """What is sound is read, and some are refused, so that the spoiling is worth it."""
    target, canary = TARGETS[name], Canary(tmp_path / "outside")
    sound, case = tmp_path / "sound", tmp_path / "case"
    sound.mkdir()
    place = target.prepare(sound).relative_to(sound)
    outcomes = []
    for number in range(-1, FILES):
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(sound, case)
        if number >= 0:
            content = (case / place).read_bytes()
            (case / place).write_bytes(target.change(content, Random(f"{name} {number}")))
        began = core_time()
        with peak_memory() as peak:
            outcome, said = what_came(target, case / place)
        assert core_time() - began < HANG, number
        assert peak.size < MEMORY, number
        assert len(said) < MESSAGE_LIMIT, number
        assert not canary.was_opened(), number
        assert "canary" not in said
        outcomes.append(outcome)
    assert outcomes[0] == "read"
    assert "refused" in outcomes
