"""Small files that claim the machine: refused by their claims, in little time and memory."""

import os
import zlib
from collections.abc import Callable
from pathlib import Path
from time import process_time

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, Header

from tendon_newton.data.formats import csv_columns
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.errors import InvalidRecording
from tests.bad_input.memory import peak_memory
from tests.formats.sessions import write_session

MEGABYTE = 1 << 20
GIGABYTE = 1 << 30
MEMORY = 200 * MEGABYTE  # Most that a refusal may take beyond what there was [bytes]
SECONDS = 10.0
"""Time of a core in which a refusal must come [s]; on a free one it is less than half."""
MAGIC = b"\x89MCAP0\r\n"


def mcap_of(path: Path, compression: str, data: bytes, size: int) -> Path:
    """Write an MCAP file of one group of messages."""
    builder = RecordBuilder()
    Header(profile="ros2", library="").write(builder)
    Chunk(
        compression=compression,
        data=data,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=0,
        uncompressed_size=size,
    ).write(builder)
    path.write_bytes(MAGIC + builder.end() + MAGIC)
    return path


def zeros_in_zstd(size: int) -> bytes:
    """Return some gigabytes of zeros, packed, without taking them."""
    packer = zstandard.ZstdCompressor().compressobj(size=size)
    parts = [packer.compress(bytes(4 * MEGABYTE)) for _ in range(size // (4 * MEGABYTE))]
    return b"".join([*parts, packer.flush()])


def zeros_in_lz4(size: int) -> bytes:
    """Return zeros, packed to a 255th, without saying how many."""
    packer = lz4.frame.LZ4FrameCompressor()
    parts = [packer.begin()]
    parts += [packer.compress(bytes(4 * MEGABYTE)) for _ in range(size // (4 * MEGABYTE))]
    return b"".join([*parts, packer.flush()])


def many_groups(path: Path) -> Path:
    """Write an honest log with as many repetitions of zeros behind it as fit into gigabytes."""
    content = write_session(path, finish=False).read_bytes()
    packed = zeros_in_zstd(4 * MEGABYTE)
    builder = RecordBuilder()
    for _ in range(200):
        Chunk(
            compression="zstd",
            data=packed,
            message_start_time=0,
            message_end_time=0,
            uncompressed_crc=zlib.crc32(bytes(4 * MEGABYTE)),
            uncompressed_size=4 * MEGABYTE,
        ).write(builder)
    path.write_bytes(content + builder.end())
    return path


def long_file(path: Path) -> Path:
    """Make a file of zeros that takes no place on the disk."""
    with path.open("wb") as file:
        file.truncate(300_000_000)
    return path


def csv_of(path: Path, row: str, count: int) -> Path:
    """Write a CSV file of equal rows."""
    with path.open("w") as file:
        file.write("t,theta,theta_dot,note\n")
        for _ in range(count // 1000):
            file.write(1000 * row)
    return path


def padded_words(path: Path) -> Path:
    """Write short words and a long one, to whose length all are padded."""
    csv_of(path, "0,0,0,a\n", 70_000)
    with path.open("a") as file:
        file.write(f"0,0,0,{1000 * 'x'}\n")
    return path


def fifo(path: Path) -> Path:
    """Make a pipe that nobody writes to."""
    os.mkfifo(path)
    return path


def bag_with(name: str, content: str, make: Callable[[Path], object]) -> Callable[[Path], Path]:
    """A folder of a bag whose file is something else."""

    def write(path: Path) -> Path:
        path.mkdir()
        (path / "metadata.yaml").write_text(content)
        make(path / name)
        return path

    return write


# name of the file, how it is made, what is said
BOMBS: dict[str, tuple[str, Callable[[Path], Path], str]] = {
    "6 GB claimed by a group of some kB":
        ("a.mcap", lambda p: mcap_of(p, "zstd", zeros_in_zstd(GIGABYTE), 6 * GIGABYTE),
        "a group claims 6442450944 bytes"),
    "1 GB inside a group that claims 1 MB":
        ("a.mcap", lambda p: mcap_of(p, "zstd", zeros_in_zstd(GIGABYTE), MEGABYTE),
        "a group of 1048576 bytes claims 1073741824 inside"),
    "1 GB in LZ4 that claims 1 MB": ("a.mcap",
        lambda p: mcap_of(p, "lz4", zeros_in_lz4(GIGABYTE), MEGABYTE),
        "a group of 1048576 bytes holds more"),
    "800 MB in groups of 4 MB": ("a.mcap", many_groups, "must unpack to at most 25 times the file"),
    "300 MB of rows": ("a.csv", long_file, "at most 268435456 bytes; it has 300000000"),
    "a story of one cell": ("a.csv", padded_words, "the words of a recording take at most"),
    "a pipe for a bag's file": ("a.db3", fifo, "it is a device or a pipe"),
    "a pipe inside a bag": ("bag", bag_with("bag.db3", "x: 1", os.mkfifo),
        "bag.db3: it is a device or a pipe"),
    "a foreign file inside a bag": ("bag",
        bag_with("bag.db3", "x: 1", lambda path: path.symlink_to("/etc/passwd")),
        "bag.db3 is a link"),
}  # fmt: skip


@pytest.mark.parametrize("case", BOMBS)
def test_a_bomb_is_refused_in_little_time_and_memory(case: str, tmp_path: Path) -> None:
    """Sizes are known before anything is unpacked."""
    name, make, said = BOMBS[case]
    path = make(tmp_path / name)
    began = process_time()
    with peak_memory() as peak, pytest.raises(InvalidRecording, match=said):
        read_recording_file(path, bench="finger", name=path.name)
    assert process_time() - began < SECONDS
    assert peak.size < MEMORY


def test_more_cells_than_any_log_are_refused(tmp_path, monkeypatch) -> None:
    """Two bytes of a file are eight in memory, so that cells are counted as well."""
    monkeypatch.setattr(csv_columns, "CELL_LIMIT", 100_000)
    path = csv_of(tmp_path / "a.csv", "0,0,0,0\n", 30_000)
    with pytest.raises(InvalidRecording, match="at most 100000 cells"):
        read_recording_file(path, bench="finger", name="a.csv")


def test_a_csv_file_takes_about_its_own_size_in_memory(tmp_path: Path) -> None:
    """Of 16 times its size before: eight bytes a number, and one more set while they are joined."""
    path = tmp_path / "a.csv"
    with path.open("w") as file:
        file.write("t,theta,theta_dot,force\n")
        for k in range(300_000):
            file.write(f"{k / 80.0:.4f},0.123456,0.123456,2.123456\n")
    with peak_memory() as peak:
        assert read_recording_file(path, bench="finger", name="a.csv").sample_count == 300_000
    assert peak.size < 6 * path.stat().st_size
