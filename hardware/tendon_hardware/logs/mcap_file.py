"""An MCAP file of ROS 2 messages that loses little when its process is killed."""

import contextlib
import io
import os
from collections.abc import Generator, Mapping
from pathlib import Path
from typing import IO, Any

from tendon_hardware.errors import LogNotWritten
from tendon_hardware.logs.ros_messages import DEFINITIONS, Message

CHUNK_SIZE = 4096
"""Bytes of messages that are compressed together: 0.2 s of one servo at 80 Hz. The writer's own
default of 1 MiB is a minute, all of which a killed process would lose."""


class McapFile:
    """A file that takes messages at once; nothing of it is kept in memory but one chunk.

    Args:
        path: The file; it must not exist.
        metadata: Metadata records to put at its front, name -> keys and values.
        endless: Whether it may grow for hours: then nothing is kept in memory, not even where each
            chunk begins, and the file is twice as large and read from its front.
    """

    def __init__(
        self, path: Path, metadata: Mapping[str, Mapping[str, str]], *, endless: bool = False
    ) -> None:
        self._path = path
        try:
            self._file = path.open("xb")
        except OSError as error:
            raise LogNotWritten(
                f"{path}: a new log must be written there; {error.strerror or error}"
            ) from error
        with self._failing():
            self._writer = ros_writer(self._file, endless=endless)
            for name, values in metadata.items():
                self._writer.add_metadata(name, dict(values))
        self._schemas: dict[str, Any] = {}

    def write(self, topic: str, kind: str, stamp: int, message: Message) -> None:
        """Write a message.

        Args:
            kind: ROS 2 type of the message.
            stamp: Instant of the recording [ns].

        Raises:
            LogNotWritten: The disk takes no more.
        """
        with self._failing():
            if kind not in self._schemas:
                self._schemas[kind] = self._writer.register_msgdef(kind, DEFINITIONS[kind])
            self._writer.write_message(topic, self._schemas[kind], message, log_time=stamp)

    def flush(self, *, sync: bool) -> None:
        """Hand what is written to the system; with ``sync`` wait until the disk has it."""
        if self._file.closed:
            return
        with self._failing():
            self._file.flush()
            if sync:
                os.fsync(self._file.fileno())

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write the last metadata records and the index, and close the file.

        Raises:
            LogNotWritten: The disk takes no more; what it took stays readable.
        """
        with self._failing():
            for name, values in metadata.items():
                self._writer.add_metadata(name, dict(values))
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
        self.close()

    def close(self) -> None:
        """Close the file as it is; more than once does no harm."""
        with contextlib.suppress(OSError):  # the rest of a full disk's buffer
            self._file.close()

    @contextlib.contextmanager
    def _failing(self) -> Generator[None]:
        try:
            yield
        except OSError as error:
            raise LogNotWritten(
                f"{self._path}: the log cannot be written any further: {error.strerror or error}; "
                "what is there stays readable"
            ) from error


def ros_writer(file: IO[bytes], *, endless: bool) -> Any:
    """Return a writer of ROS 2 messages."""
    from mcap.writer import Writer as PlainWriter
    from mcap_ros2.writer import Writer

    if not endless:
        return Writer(file, chunk_size=CHUNK_SIZE)
    # with chunks the writer keeps an index of them for the end: 50 MB for an hour of a deployment.
    # The index cannot be switched off, but the writer takes another one beneath it
    writer = Writer(io.BytesIO())
    plain = PlainWriter(file, use_chunking=False)
    plain.start(profile="ros2", library="tendon-newton")
    vars(writer)["_writer"] = plain
    return writer
