"""Recordings as MCAP files of ROS 2 messages, those of killed processes included."""

from __future__ import annotations

import importlib
import logging
import re
from collections import Counter
from collections.abc import Callable, Iterator, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from tendon_newton.data.files.text_file import absence, open_bytes
from tendon_newton.data.formats.message_streams import Stream, TimedMessage, read_streams
from tendon_newton.data.formats.topic_mapping import SESSION_RECORD, TopicMapping
from tendon_newton.errors import InvalidRecording, MissingDependency

if TYPE_CHECKING:
    from mcap.records import Channel, Chunk, McapRecord, Message, Schema

PACKING = 25
"""Most that compression may have saved [1]; logs of servos are packed to a fifth or a tenth."""
UNPACKED_AT_LEAST = 1 << 23
"""Bytes that any file may unpack to: a small one may hold little else than repetitions."""
CHUNK_LIMIT = 1 << 26  # Bytes of one group; writers make them of 4 KB to 4 MB


class TooLarge(Exception):
    """A group of messages unpacks to more than it may; the message says how."""


def unpacked(chunk: Chunk, limit: int) -> Chunk:
    """Return a group of messages that is not compressed.

    Raises:
        TooLarge: The group claims more, or holds more than it claims.
    """
    limit = min(limit, CHUNK_LIMIT)
    if chunk.uncompressed_size > limit:
        raise TooLarge(f"a group claims {chunk.uncompressed_size} bytes")
    if chunk.compression == "zstd":
        data = from_zstd(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "lz4":
        data = from_lz4(chunk.data, chunk.uncompressed_size)
    else:
        data = chunk.data
    return replace(chunk, compression="", data=data)


def from_zstd(data: bytes, size: int) -> bytes:
    """Unpack one frame of Zstandard that holds so many bytes."""
    import zstandard

    claimed = zstandard.frame_content_size(data)  # what the frame itself says, -1 for nothing
    if claimed > size:
        raise TooLarge(f"a group of {size} bytes claims {claimed} inside")
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=max(size, 1))


def from_lz4(data: bytes, size: int) -> bytes:
    """Unpack one frame of LZ4 that holds so many bytes."""
    lz4: Any = importlib.import_module("lz4.frame")  # without types
    unpacker = lz4.LZ4FrameDecompressor()
    found: bytes = unpacker.decompress(data, max_length=size + 1)
    if len(found) > size:
        raise TooLarge(f"a group of {size} bytes holds more")
    return found


log = logging.getLogger(__name__)
ENDLESS = re.compile(rb"\b(?:byte|char|u?int8)\[\d+\]|\[0+\]")
"""Fields that take nothing from the end of a message: a list of such, of a claimed length of
billions, would be read for ever."""


def read_mcap(
    path: Path, mapping: TopicMapping, name: str
) -> tuple[dict[str, str], dict[str, Stream], dict[str, str]]:
    """Read a file's topics, its mapped columns and how it was made.

    Where it breaks off, what came before is read and a warning says so.
    """
    if not path.is_file():
        raise InvalidRecording(f"{name}: {absence(path)} ({path})")
    wanted = {source.topic for source in mapping.sources.values()}
    with open_bytes(path, InvalidRecording, "a recording is an MCAP file") as file:
        reading = McapReading(file, name)
        streams = read_streams(reading.messages(wanted), mapping, name)
    reading.warn()
    return reading.topics, streams, reading.session


def messages_of(path: Path, *topics: str) -> Iterator[TimedMessage]:
    """Yield topic, stamp [ns] and content of each message of some topics of a file, in order."""
    with path.open("rb") as file:
        yield from McapReading(file, path.name).messages(set(topics))


def read_session(path: Path) -> dict[str, str]:
    """Read how a recording was made; of several records the last is whole, so it holds."""
    from_file: dict[str, str] = {}
    with path.open("rb") as file:
        for record in McapReading(file, path.name).records():
            if type(record).__name__ == "Metadata" and record.name == SESSION_RECORD:
                from_file = dict(record.metadata)
    return from_file


def breaks_off(path: Path) -> bool:
    """Tell whether a file lacks its end: its program was killed, or writes it still."""
    from mcap.writer import MCAP0_MAGIC

    return not path.read_bytes().endswith(MCAP0_MAGIC)


@dataclass(kw_only=True)
class Damage:
    """Part of a file that could not be read."""

    broken_off: str = ""  # Reason of an end of reading before the file's own end
    chunks: int = 0  # Groups of messages that were damaged
    # Messages by topic that could not be decoded
    undecoded: Counter[str] = field(default_factory=Counter[str])


class McapReading:
    """One pass through an MCAP file, from the front, keeping all that is whole.

    The index at the end is not used: a file whose process was killed has none.
    """

    def __init__(self, file: IO[bytes], name: str) -> None:
        self.file = file
        self.name = name
        self.damage = Damage()
        self.topics: dict[str, str] = {}
        self.session: dict[str, str] = {}
        self.messages_read = 0
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.unpacked_limit = 0

    def messages(self, wanted: Set[str]) -> Iterator[TimedMessage]:
        """Decode the messages of some topics."""
        decode: dict[int, Callable[[bytes], Any]] = {}
        for record in self.records():
            kind = type(record).__name__
            if kind == "Schema":
                self.schemas[record.id] = record
            elif kind == "Channel":
                schema = self.schemas.get(record.schema_id)
                self.topics[record.topic] = schema.name if schema else "no schema"
                self.channels[record.id] = record
            elif kind == "Metadata" and record.name == SESSION_RECORD:
                self.session = dict(record.metadata)  # of several the last is whole
            elif kind == "Message" and record.channel_id in self.channels:
                channel = self.channels[record.channel_id]
                if channel.topic not in wanted:
                    continue
                if channel.id not in decode:
                    decode[channel.id] = self.decoder_of(channel)
                yield from self.decoded(record, channel, decode[channel.id])

    def decoded(
        self, record: Message, channel: Channel, decode: Callable[[bytes], Any]
    ) -> Iterator[TimedMessage]:
        """Decode one message; one that is damaged is counted and left out."""
        try:
            message = decode(record.data)
        except Exception:  # damaged bytes make the decoder fail in any way
            self.damage.undecoded[channel.topic] += 1
            return
        self.messages_read += 1
        yield channel.topic, record.log_time, message

    def decoder_of(self, channel: Channel) -> Callable[[bytes], Any]:
        """Return what decodes a channel's messages."""
        from mcap_ros2.decoder import DecoderFactory

        schema = self.schemas.get(channel.schema_id)
        if schema and ENDLESS.search(schema.data):
            raise InvalidRecording(
                f"{self.name}: topic {channel.topic!r} must come with a ROS 2 message definition "
                "that can be read; arrays of bytes of fixed length cannot"
            )
        try:
            decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
        except Exception as error:  # a foreign or damaged definition of a message
            raise InvalidRecording(
                f"{self.name}: topic {channel.topic!r} must come with a ROS 2 message definition "
                f"that can be read; reading its own gives {type(error).__name__}: {error}"
            ) from error
        if decoder is None:
            encoding = schema.encoding if schema else "none"
            raise InvalidRecording(
                f"{self.name}: topic {channel.topic!r} must hold ROS 2 messages, encoding 'cdr' "
                f"with schema 'ros2msg'; they are {channel.message_encoding!r} with {encoding!r}"
            )
        return decoder

    def records(self) -> Iterator[Any]:
        """Read the records one by one, up to the end or to where the file breaks off."""
        try:
            from mcap.stream_reader import StreamReader, breakup_chunk
        except ModuleNotFoundError as error:
            raise MissingDependency(
                f"{self.name}: an MCAP file needs the package 'mcap', which is not installed; "
                "pip install 'tendon-newton[sim]' or 'tendon-newton[hardware]'"
            ) from error
        size = self.file.seek(0, 2)
        self.file.seek(0)
        self.unpacked_limit = UNPACKED_AT_LEAST + PACKING * size
        stream = StreamReader(self.file, emit_chunks=True, record_size_limit=size)
        records = iter(stream.records)
        started = False
        while True:
            try:
                record: McapRecord = next(records)
            except StopIteration:
                return
            except Exception as error:  # a reader of damaged bytes fails in any way
                if not started:
                    raise InvalidRecording(
                        f"{self.name}: an MCAP file must begin with its magic bytes and a header; "
                        f"this one has {size} bytes and does not"
                    ) from error
                self.damage.broken_off = type(error).__name__
                return
            started = True
            if type(record).__name__ != "Chunk":
                yield record
                continue
            try:
                plain = unpacked(record, self.unpacked_limit)  # pyright: ignore
                self.unpacked_limit -= len(plain.data)
                parts = breakup_chunk(plain, validate_crc=True)
            except TooLarge as error:
                raise InvalidRecording(
                    f"{self.name}: its messages must unpack to at most {PACKING} times the file; "
                    f"{error}"
                ) from error
            except Exception:  # the same, inside a compressed chunk
                self.damage.chunks += 1
                continue
            yield from parts

    def warn(self) -> None:
        """Say what could not be read."""
        damage = self.damage
        if damage.broken_off:
            log.warning(
                "%s: the file breaks off (its program was killed, or the disk was full); "
                "%d messages before that are read",
                self.name,
                self.messages_read,
            )
        if damage.chunks:
            log.warning("%s: %d damaged groups of messages are left out", self.name, damage.chunks)
        for topic, count in damage.undecoded.items():
            log.warning("%s: %d damaged messages on %s are left out", self.name, count, topic)
