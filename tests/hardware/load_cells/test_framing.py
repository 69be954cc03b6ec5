"""Lines of a load cell in whatever bytes arrive."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.load_cells.framing import LONGEST_LINE, Frame, LineSplitter, crc8, decode_line
from tests.hardware.load_cells.streams import encode_frame

frames = st.builds(
    Frame,
    sequence=st.integers(0, 2**32 - 1),
    device_time_us=st.integers(0, 2**32 - 1),
    counts=st.integers(-(2**23), 2**23 - 1),
)


def test_the_checksum_is_the_common_crc_8() -> None:
    """Its check value over the nine digits is that of every catalogue of CRCs."""
    assert crc8(b"123456789") == 0xF4
    assert crc8(b"") == 0


def test_a_line_is_as_the_format_says() -> None:
    """One reading, written out."""
    line = encode_frame(Frame(sequence=7, device_time_us=12_500, counts=-42))
    assert line == b"L,7,12500,-42*%02X\n" % crc8(b"L,7,12500,-42")


@given(frame=frames)
def test_a_line_gives_back_its_reading(frame: Frame) -> None:
    """Every number of the format survives, and fits the longest line."""
    line = encode_frame(frame)
    assert decode_line(line.rstrip(b"\n")) == frame
    assert len(line) <= LONGEST_LINE


@given(frame=frames, position=st.integers(0, 100), bit=st.integers(0, 7))
def test_no_flipped_bit_passes(frame: Frame, position: int, bit: int) -> None:
    """A CRC-8 finds every single flipped bit; the pattern finds the rest."""
    line = bytearray(encode_frame(frame).rstrip(b"\n"))
    line[position % len(line)] ^= 1 << bit
    decoded = decode_line(bytes(line))
    # a flipped bit may turn a hexadecimal digit of the checksum into its lower case
    assert decoded is None or decoded == frame


@given(pieces=st.lists(st.binary(max_size=80), max_size=20))
def test_no_bytes_raise_or_become_a_reading_with_a_wrong_checksum(pieces: list[bytes]) -> None:
    """Whatever comes, in whatever pieces: what is accepted is exactly what its CRC covers."""
    splitter = LineSplitter()
    for piece in pieces:
        for line in splitter.feed(piece):
            frame = decode_line(line)
            if frame is not None:
                assert int(line[-2:], 16) == crc8(line[:-3])


@given(
    soup=st.lists(st.one_of(frames, st.binary(max_size=30).filter(lambda b: b"\n" not in b))),
    cuts=st.lists(st.integers(1, 40), min_size=1),
)
def test_whole_lines_are_found_in_garbage_however_it_is_cut(
    soup: list[Frame | bytes], cuts: list[int]
) -> None:
    """Garbage costs the line that it stands in and no other."""
    stream = b"".join(encode_frame(x) if isinstance(x, Frame) else x + b"\n" for x in soup)
    splitter, found, at, turn = LineSplitter(), [], 0, 0
    while at < len(stream):
        size = cuts[turn % len(cuts)]
        found += [decode_line(line) for line in splitter.feed(stream[at : at + size])]
        at, turn = at + size, turn + 1
    sent = [x for x in soup if isinstance(x, Frame)]
    assert [frame for frame in found if frame in sent] == sent


def test_bytes_without_an_end_of_line_do_not_pile_up() -> None:
    """A stream at another rate may never send one."""
    splitter = LineSplitter()
    for _ in range(1000):
        assert splitter.feed(b"\x80" * 100) == []
    (line,) = splitter.feed(b"\n")
    assert len(line) <= LONGEST_LINE
    frame = Frame(sequence=1, device_time_us=2, counts=3)
    assert [decode_line(x) for x in splitter.feed(encode_frame(frame))] == [frame]


@pytest.mark.parametrize(
    "body", ["L,4294967296,0,0", "L,0,4294967296,0", "L,0,0,8388608", "L,0,0,-8388609", "L,0,0"]
)
def test_numbers_that_no_converter_gives_are_refused(body: str) -> None:
    """Beyond 32 bits of clock or 24 bits of counts, even with a checksum that fits."""
    assert decode_line(b"%s*%02X" % (body.encode(), crc8(body.encode()))) is None


def test_the_checksum_lets_few_random_lines_pass(rng: np.random.Generator) -> None:
    """Of lines with random digits one in 256 passes; hence readings are checked for order too."""
    passed = 0
    for _ in range(20_000):
        a, b, c = rng.integers(0, 10_000, 3)
        passed += decode_line(b"L,%d,%d,%d*%02X" % (a, b, c, rng.integers(0, 256))) is not None
    assert passed == pytest.approx(20_000 / 256, abs=5.0 * np.sqrt(20_000 / 256))  # 5 sigma
