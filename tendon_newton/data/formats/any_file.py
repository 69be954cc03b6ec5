"""A recording from whatever file holds it: CSV, MCAP, or a ROS 2 bag."""

from pathlib import Path
from typing import Any

from tendon_newton.data.formats.csv_file import read_csv
from tendon_newton.data.formats.topic_mapping import DEFAULT_MAPPING, TopicMapping
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording


def read_recording_file(
    path: Path, *, bench: str, name: str, mapping: TopicMapping | None = None, **entry: Any
) -> Recording:
    """Read one recording in the format that its file has.

    Args:
        path: A .csv, .mcap or .db3 file, or the folder of a ROS 2 bag.
        mapping: Which topic and field is which column; our own topics unless given.
        entry: What else the dataset says of it.
    """
    if path.suffix == ".mcap" and not path.is_dir():
        from tendon_newton.data.formats.mcap_file import read_mcap as read
    elif path.is_dir() or path.suffix == ".db3":
        from tendon_newton.data.formats.rosbag import read_rosbag as read
    elif mapping is not None:
        raise InvalidRecording(
            f"{name}: a mapping of topics belongs to an .mcap file or a ROS 2 bag; this is neither"
        )
    else:
        return read_csv(path, bench=bench, name=name, **entry)
    return read(path, bench=bench, name=name, mapping=mapping or DEFAULT_MAPPING, **entry)
