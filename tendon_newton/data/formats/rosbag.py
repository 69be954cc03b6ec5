"""Recordings as ROS 2 bags that other programs wrote: folders, and bare .db3 files."""

import importlib.util
import os
from collections.abc import Iterator, Set
from contextlib import AbstractContextManager
from dataclasses import fields
from pathlib import Path
from typing import Any

from tendon_newton.data.files.guarded import MEMORY, SECONDS, TooMuch, guarded
from tendon_newton.data.files.text_file import absence
from tendon_newton.data.formats.message_streams import Stream, TimedMessage, read_streams
from tendon_newton.data.formats.topic_mapping import TopicMapping
from tendon_newton.errors import InvalidRecording, MissingDependency

METADATA_FILE = "metadata.yaml"
UNPACKED = 8  # Memory that a bag may take, in its own sizes, beyond what any work may [1]
BYTES_PER_SECOND = 250_000
"""Bytes that are surely read in a second of a core; ten times as many are usual."""


def read_rosbag(
    path: Path, mapping: TopicMapping, name: str
) -> tuple[dict[str, str], dict[str, Stream], dict[str, str]]:
    """Read a bag's topics and its mapped columns; nothing in it says how it was made.

    Args:
        path: A folder with ``metadata.yaml``, or a .db3 file alone.
    """
    if not path.exists():
        raise InvalidRecording(f"{name}: no such file or folder ({path})")
    if path.is_dir() and not (path / METADATA_FILE).is_file():
        files = sorted(file.name for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
        hint = f"; list a file of it alone: {path.name}/{files[0]}" if files else ""
        raise InvalidRecording(f"{name}: a bag is a folder with {METADATA_FILE}; it has none{hint}")
    if importlib.util.find_spec("rosbags") is None:
        raise MissingDependency(
            f"{name}: a ROS 2 bag needs the package 'rosbags', which is not installed; "
            "pip install 'tendon-newton[ros]'"
        )
    size = refuse_foreign_parts(path, name)
    settings = {each.name: getattr(mapping, each.name) for each in fields(mapping)}
    settings["sources"] = dict(mapping.sources)
    try:
        topics, streams = guarded(
            bag_streams,
            path.resolve(),
            settings,
            name,
            memory=MEMORY + UNPACKED * size,
            seconds=SECONDS + size // BYTES_PER_SECOND,
        )
    except TooMuch as error:
        raise InvalidRecording(f"{name}: must be a ROS 2 bag; reading it {error} ({path})") from (
            error
        )
    return topics, streams, {}


def refuse_foreign_parts(path: Path, name: str) -> int:
    """Refuse a bag with parts that are no files of its own; return how many bytes it has."""
    home = Path(os.path.realpath(path))
    parts = sorted(home.iterdir()) if path.is_dir() else [home]
    for part in parts:
        if not part.is_file():
            raise InvalidRecording(f"{name}: a bag holds files; {part.name}: {absence(part)}")
        if part.is_symlink():
            raise InvalidRecording(
                f"{name}: a bag holds files of its own; {part.name} is a link: copy the file"
            )
    return sum(part.stat().st_size for part in parts)


def bag_streams(
    path: Path, settings: dict[str, Any], name: str
) -> tuple[dict[str, str], dict[str, Stream]]:
    """Read a bag's topics and its mapped columns."""
    mapping = TopicMapping(**settings)
    wanted = {source.topic for source in mapping.sources.values()}
    try:
        with open_bag(path) as bag:
            topics = {topic: info.msgtype or "several types" for topic, info in bag.topics.items()}
            return topics, read_streams(bag_messages(bag, wanted), mapping, name)
    except (InvalidRecording, MemoryError):
        raise
    except Exception as error:  # SQLite, YAML, CDR and rosbags' own errors share no base
        raise InvalidRecording(
            f"{name}: must be a ROS 2 bag that rosbags can read; it says "
            f"{type(error).__name__}: {error} ({path})"
        ) from error


def open_bag(path: Path) -> AbstractContextManager[Any]:
    """Open a bag; one without definitions of its messages is taken as ROS 2 Humble's."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    return AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))


def bag_messages(bag: Any, wanted: Set[str]) -> Iterator[TimedMessage]:
    """Decode the messages of some topics."""
    connections = [connection for connection in bag.connections if connection.topic in wanted]
    if not connections:
        return
    for connection, time, data in bag.messages(connections=connections):
        yield connection.topic, time, bag.deserialize(data, connection.msgtype)
