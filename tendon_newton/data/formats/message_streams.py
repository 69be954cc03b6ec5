"""ROS 2 messages, whatever decoded them, as time series of numbers."""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.files.values import are_words
from tendon_newton.data.formats.topic_mapping import TopicMapping, TopicSource, field_steps
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, shown

Nanoseconds = NDArray[np.int64]
TIME_LIMIT = 1 << 62  # Nanoseconds, 146 years, since the epoch of any clock
TimedMessage = tuple[str, int, Any]  # (topic, time of recording [ns], decoded message)


@dataclass(frozen=True, kw_only=True, eq=False)
class Stream:
    """One column of a recording at the times of its own messages."""

    # Instants [ns] since the recording clock's epoch, never decreasing, shape (N,)
    time: Nanoseconds
    values: Array  # Values in SI units, one column per tendon, shape (N, D)
    # Names of the joints, where the messages give them; frames of sensors otherwise
    names: tuple[str, ...] = ()


def read_streams(
    messages: Iterable[TimedMessage], mapping: TopicMapping, name: str
) -> dict[str, Stream]:
    """Gather the mapped columns of a recording.

    Args:
        messages: All messages of the mapped topics, in any order.

    Returns:
        Column -> stream, in order of time; several values at one instant are kept.
    """
    by_topic: dict[str, list[Collector]] = {}
    for column, source in mapping.sources.items():
        collector = Collector(column, source, mapping.clock, name)
        by_topic.setdefault(source.topic, []).append(collector)
    for topic, log_time, message in messages:
        for collector in by_topic.get(topic, ()):
            collector.take(log_time, message)
    collectors = [collector for group in by_topic.values() for collector in group]
    return {c.column: c.stream() for c in collectors if c.times}


class Collector:
    """Takes one column out of the messages of a topic.

    Args:
        clock: ``header`` or ``log``.
    """

    def __init__(self, column: str, source: TopicSource, clock: str, name: str) -> None:
        self.column = column
        self.source = source
        self.steps = field_steps(source.field)
        self.header = clock == "header"
        self.where = f"{name}: topic {shown(source.topic)}, field {shown(source.field)} ({column})"
        self.times: list[int] = []
        self.rows: list[list[float]] = []
        self.frames: list[str] = []
        self.names: tuple[str, ...] = ()

    def take(self, log_time: int, message: Any) -> None:
        """Keep the value of one message."""
        values = as_numbers(self.follow(message), self.where)
        if not values:
            return  # an empty array says that the sender does not measure this
        names = joint_names(message)
        if names is not None and len(names) == len(values):
            values = self.pick(names, values)
        elif self.source.joints:
            raise InvalidRecording(f"{self.where}: joints are given, but its messages name none")
        self.times.append(self.time_of(message, log_time))
        self.rows.append(values)
        self.frames.append(sys.intern(frame(message)))

    def time_of(self, message: Any, log_time: int) -> int:
        """Return the time of a message [ns] on the clock that is wanted."""
        try:
            time = stamp(message, log_time) if self.header else log_time
        except (AttributeError, TypeError, ValueError, OverflowError) as error:
            raise InvalidRecording(
                f"{self.where}: a header must have a stamp of sec and nanosec; these messages' "
                f"definition has another one ({error})"
            ) from error
        if abs(time) >= TIME_LIMIT:
            raise InvalidRecording(f"{self.where}: a message has the impossible time {time} ns")
        return time

    def follow(self, message: Any) -> Any:
        """Follow the field's path into a message."""
        value = message
        try:
            for step in self.steps:
                if isinstance(step, int):
                    value = value[step]
                elif step.startswith("["):
                    pairs = [pair.value for pair in value if pair.key == step[1:-1]]
                    if not pairs:
                        return []  # this message does not tell
                    value = pairs[0]
                else:
                    value = getattr(value, step)
        except (AttributeError, IndexError, TypeError) as error:
            there = ", ".join(sorted(k for k in fields_of(message) if not k.startswith("_")))
            raise InvalidRecording(
                f"{self.where}: its messages have no such field; there are {there}"
            ) from error
        return value

    def pick(self, names: list[str], values: list[float]) -> list[float]:
        """Take the wanted joints, in the wanted order."""
        wanted = list(self.source.joints or names)
        missing = [joint for joint in wanted if joint not in names]
        if missing:
            raise InvalidRecording(
                f"{self.where}: joint {missing[0]!r} is missing; there are {', '.join(names)}"
            )
        self.names = tuple(wanted)
        return [values[names.index(joint)] for joint in wanted]

    def stream(self) -> Stream:
        """Return what was taken, in order of time."""
        widths = {len(row) for row in self.rows}
        if len(widths) > 1:
            raise InvalidRecording(
                f"{self.where}: every message must hold the same number of values; "
                f"they hold {' or '.join(map(str, sorted(widths)))}"
            )
        time = np.array(self.times, dtype=np.int64)
        if self.header and time.size > 1 and np.all(time == time[0]):
            raise InvalidRecording(
                f"{self.where}: the stamps of its {time.size} messages are all the same; "
                'use the times of recording: clock = "log" in a mapping file'
            )
        order = np.argsort(time, kind="stable")
        values = np.array(self.rows, dtype=np.float64)[order]
        values = self.source.scale * values + self.source.offset
        frames = sorted(set(self.frames))
        if values.shape[1] == 1 and not self.names and len(frames) > 1:
            return self.by_frame(time[order], values, np.array(self.frames)[order])
        return Stream(time=time[order], values=values, names=self.names or tuple(frames))

    def by_frame(self, time: Nanoseconds, values: Array, frames: NDArray[np.str_]) -> Stream:
        """Set sensors that share a topic side by side, at the first one's times."""
        names = tuple(self.source.joints or sorted(set(frames.tolist())))
        (first, *_) = [frames == frame for frame in names]
        columns: list[Array] = [
            np.interp(time[first], time[frames == frame], values[frames == frame, 0])
            for frame in names
        ]
        return Stream(time=time[first], values=np.column_stack(columns), names=names)


def as_numbers(value: Any, where: str) -> list[float]:
    """Return a number, or an array of them, as a list."""
    items = list(value) if not isinstance(value, str) and hasattr(value, "__len__") else [value]
    try:
        return [float(item) for item in items]
    except (TypeError, ValueError) as error:
        raise InvalidRecording(f"{where}: must hold numbers; it holds {value!r:.60}") from error


def joint_names(message: Any) -> list[str] | None:
    """Return the names of the joints that a message lists, or None where it lists none."""
    names: Any = getattr(message, "name", None)
    return names if are_words(names) else None


def stamp(message: Any, log_time: int) -> int:
    """Return a message's own time [ns], or when it was recorded where it has none."""
    header = getattr(message, "header", None)
    if header is None:
        return log_time
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def frame(message: Any) -> str:
    """Return the frame that a message names, or nothing."""
    return str(getattr(getattr(message, "header", None), "frame_id", ""))


def fields_of(message: Any) -> list[str]:
    """Names of a message's fields."""
    return [*(getattr(message, "__slots__", None) or vars(message))]
