"""A recording from whatever file holds it: CSV, MCAP, or a ROS 2 bag."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tendon_newton.data.formats.csv_columns import read_columns
from tendon_newton.data.formats.csv_file import recording_of
from tendon_newton.data.formats.message_streams import Stream
from tendon_newton.data.formats.resampling import rows_of
from tendon_newton.data.formats.topic_mapping import DEFAULT_MAPPING, TopicMapping
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording, shown


def read_recording_file(
    path: Path,
    *,
    bench: str,
    name: str | None = None,
    mapping: TopicMapping | None = None,
    **entry: Any,
) -> Recording:
    """Read one recording in the format that its file has.

    Args:
        path: A .csv, .mcap or .db3 file, or the folder of a ROS 2 bag.
        name: Name for messages and outputs; the file's own name unless given.
        mapping: Which topic and field is which column; our own topics unless given.
        entry: What else the dataset says of it (``start``, ``bench_overrides``,
            ``actuator_overrides``, ``load_cell_rate``, ``obstacle``); an obstacle that the file
            states holds unless given.

    Raises:
        InvalidRecording: The file is none of its format, is damaged, or lacks a column or topic.
        MissingDependency: The packages that read it are not installed.
    """
    name = name or path.name
    if path.suffix == ".mcap" and not path.is_dir():
        from tendon_newton.data.formats.mcap_file import read_mcap as read
    elif path.is_dir() or path.suffix == ".db3":
        from tendon_newton.data.formats.rosbag import read_rosbag as read
    elif mapping is not None:
        raise InvalidRecording(
            f"{name}: a mapping of topics belongs to an .mcap file or a ROS 2 bag; this is neither"
        )
    else:
        return recording_of(read_columns(path, name), name=name, bench=bench, **entry)
    mapping = mapping or DEFAULT_MAPPING
    topics, streams, session = read(path, mapping, name)
    require_topics(streams, mapping, topics, name)
    if "obstacle" in session:
        entry = {"obstacle": session["obstacle"], **entry}
    entry["servo"] = session.get("servo.model")
    return Recording(name=name, bench=bench, **rows_of(streams, mapping, name), **entry)


def require_topics(
    streams: Mapping[str, Stream], mapping: TopicMapping, topics: Mapping[str, str], name: str
) -> None:
    """Refuse a file without a topic that its mapping names, listing those there."""
    for column, source in mapping.sources.items():
        if column in streams or column in mapping.optional:
            continue
        there = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(topics.items()))
        lack = "holds no value of it" if source.topic in topics else "is missing"
        hint = "" if mapping.path else "; a mapping names yours: docs/recordings_mapping.md"
        raise InvalidRecording(
            f"{name}: {column} comes from topic {shown(source.topic)}, field "
            f"{shown(source.field)}, which {lack}; there are {there or 'no topics'}{hint}"
        )
