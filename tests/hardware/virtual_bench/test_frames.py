"""Frames of the bus, byte by byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.virtual_bench.memory.protocol import (
    PING,
    READ,
    REBOOT,
    WRITE,
    FrameParser,
    frame,
    status_frame,
    stuffed,
    unstuffed,
)

# examples of the e-manual's page on Protocol 2.0
EXAMPLES = {
    "ping": (frame(1, PING, b""), "fffffd000103000119 4e"),
    "answer to ping": (status_frame(1, 0, b"\x06\x04\x26"), "fffffd000107005500060426655d"),
    "read": (frame(1, READ, b"\x84\x00\x04\x00"), "fffffd000107000284000400 1d15"),
    "answer to read": (status_frame(1, 0, b"\xa6\x00\x00\x00"), "fffffd000108005500a6000000 8cc0"),
    "write": (frame(1, WRITE, b"\x74\x00\x00\x02\x00\x00"), "fffffd000109000374000002 0000ca89"),
    "answer to write": (status_frame(1, 0), "fffffd000104005500a10c"),
    "reboot": (frame(1, REBOOT, b""), "fffffd0001030008 2f4e"),
    "stuffed write": (
        frame(1, WRITE, b"\x74\x00\xff\xff\xfd\x00"),
        "fffffd00010a00037400 fffffdfd00 21e7",
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_frame_is_the_manuals_example(name) -> None:
    """Header, length, CRC and stuffing are those that ROBOTIS prints, byte for byte."""
    built, printed = EXAMPLES[name]
    assert built == bytes.fromhex(printed)


@given(body=st.binary(max_size=40))
def test_unstuffing_undoes_stuffing(body) -> None:
    """Whatever a body holds comes back, and stuffed it holds no header."""
    assert unstuffed(stuffed(body)) == body
    assert b"\xff\xff\xfd\x00" not in stuffed(body) + b"\xfd"


def test_an_instruction_without_stuffing_is_understood() -> None:
    """dynamixel_sdk 4.1 sends FF FF FD unstuffed; its frame is taken for what it means."""
    sent = bytes.fromhex("fffffd000109000374 00fffffd00c907")
    (instruction,) = FrameParser().feed(sent)
    assert instruction.intact
    assert instruction.parameters == b"\x74\x00\xff\xff\xfd\x00"


@given(noise=st.binary(max_size=30), cut=st.integers(1, 13))
def test_a_frame_survives_noise_and_pieces(noise, cut) -> None:
    """A frame after noise is found even when it comes in two pieces; noise alone never raises."""
    parser = FrameParser()
    parser.feed(noise)
    whole = frame(1, READ, b"\x84\x00\x04\x00")
    found = parser.feed(whole[:cut]) + parser.feed(whole[cut:])
    # noise that ends in a header with a length of its own may swallow what follows, as on a bus
    if b"\xff" not in noise:
        assert [each.code for each in found] == [READ]


def test_a_wrong_check_sum_is_seen() -> None:
    """One flipped bit and the frame counts as broken."""
    broken = bytearray(frame(1, READ, b"\x84\x00\x04\x00"))
    broken[9] ^= 4
    (instruction,) = FrameParser().feed(bytes(broken))
    assert not instruction.intact
