"""Compressed groups of messages, unpacked no further than their file can honestly hold."""

from __future__ import annotations

import importlib
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mcap.records import Chunk

PACKING = 25
"""Most that compression may have saved [1]; logs of servos are packed to a fifth or a tenth."""
UNPACKED_AT_LEAST = 1 << 23
"""Bytes that any file may unpack to: a small one may hold little else than repetitions."""
CHUNK_LIMIT = 1 << 26
"""Bytes of one group; writers make them of 4 KB to 4 MB."""


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
