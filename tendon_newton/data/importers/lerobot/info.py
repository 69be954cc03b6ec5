"""``meta/info.json`` of a LeRobotDataset: which joint stands where."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import SIZE_LIMIT, finite_number, read_text
from tendon_newton.data.files.values import are_words, is_count, is_list, is_table
from tendon_newton.errors import InvalidRecording, listed, shown

INFO = Path("meta") / "info.json"
COMMAND, STATE = "action", "observation.state"
SUFFIX = ".pos"  # What LeRobot hangs on the name of a joint whose position is meant
JOINT_LIMIT = 64  # More joints than a humanoid has


@dataclass(frozen=True, kw_only=True)
class JointPlace:
    """Where a joint stands in the lists of a row."""

    name: str  # Without LeRobot's suffix; fit for a file's name
    command: int  # Place in ``action``
    state: int  # Place in ``observation.state``


@dataclass(frozen=True, kw_only=True)
class LeRobotInfo:
    """What the importer needs of the file."""

    rate: float  # Rows per second that were asked for [Hz]
    joints: tuple[JointPlace, ...]  # Joints that are both commanded and measured
    rows: int | None = None  # Rows that the dataset should have; None where it does not say
    episodes: int | None = None  # Episodes, likewise
    # Rows that some episodes should have, by their number
    lengths: Mapping[int, int] = field(default_factory=dict[int, int])


def read_info(folder: Path) -> LeRobotInfo:
    """Read and check the file.

    Raises:
        InvalidRecording: It is none, or no joint is both commanded and measured.
    """
    path = folder / INFO
    promise = "a LeRobotDataset is a folder with this JSON file in it"
    table = read_json(path, InvalidRecording, promise, size_limit=SIZE_LIMIT)
    features = table.get("features")
    if not is_table(features):
        raise InvalidRecording(f"{path}: {promise} with a table 'features'; it has none")
    rate = finite_number(table.get("fps"))
    if rate is None or rate <= 0.0:
        raise InvalidRecording(f"{path}: fps must be positive; it is {shown(table.get('fps'))}")
    commands, states = (names_of(path, features, key) for key in (COMMAND, STATE))
    joints = tuple(
        JointPlace(name=name, command=commands.index(name), state=states.index(name))
        for name in commands
        if name in states
    )
    if not joints:
        raise InvalidRecording(
            f"{path}: a joint must stand in {COMMAND} and in {STATE}; they name "
            f"{listed(commands)} and {listed(states)}: goals of joints are needed, and a place of "
            "the tip or a change of it is none"
        )
    rows, episodes = (
        value if is_count(value := table.get(key)) else None
        for key in ("total_frames", "total_episodes")
    )
    return LeRobotInfo(
        rate=rate, joints=joints, rows=rows, episodes=episodes, lengths=read_lengths(folder)
    )


def read_lengths(folder: Path) -> dict[int, int]:
    """Return the lengths that a dataset of v2 states of its episodes; none where it states none."""
    path = folder / "meta" / "episodes.jsonl"
    if not path.is_file():
        return {}
    lengths: dict[int, int] = {}
    text = read_text(path, InvalidRecording, "episodes are JSON lines", size_limit=SIZE_LIMIT)
    for line in text.splitlines():
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            continue
        own = row if is_table(row) else {}
        number, length = own.get("episode_index"), own.get("length")
        if is_count(number) and is_count(length):
            lengths[number] = length
    return lengths


def names_of(path: Path, features: dict[str, Any], key: str) -> list[str]:
    """Return the names of a feature's entries, or made-up ones where there are none."""
    feature = features.get(key)
    if not is_table(feature):
        raise InvalidRecording(
            f"{path}: features must hold {key!r}; there are {listed(map(str, features))}"
        )
    names = feature.get("names")
    if is_table(names) and len(names) == 1:  # {"motors": [...]}
        (names,) = names.values()
    if names is None:
        names = [f"joint_{place}" for place in range(length_of(path, feature, key))]
    if not are_words(names):
        raise InvalidRecording(f"{path}: names of {key} must be a list; they are {shown(names)}")
    shape = feature.get("shape")
    if is_list(shape) and len(shape) == 1 and shape[0] != len(names):
        raise InvalidRecording(
            f"{path}: {key} has {shown(shape[0])} numbers a row and names {len(names)} of them: "
            "name each, in the order of the row"
        )
    plain = [re.sub(r"[^\w-]", "_", name.removesuffix(SUFFIX)) for name in names]
    if not 0 < len(plain) <= JOINT_LIMIT or len(set(plain)) < len(plain) or "" in plain:
        raise InvalidRecording(
            f"{path}: {key} must have 1 to {JOINT_LIMIT} entries with names that differ; they are "
            f"{listed(names)}"
        )
    return plain


def length_of(path: Path, feature: dict[str, Any], key: str) -> int:
    """Return how many entries a feature without names has."""
    shape = feature.get("shape")
    if (
        not is_list(shape)
        or len(shape) != 1
        or not isinstance(shape[0], int)
        or not 0 < shape[0] <= JOINT_LIMIT
    ):
        raise InvalidRecording(
            f"{path}: {key} without names must have a shape of one number, up to {JOINT_LIMIT}; "
            f"it is {shown(shape)}"
        )
    return shape[0]
