"""The position loop on the host."""

from math import nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import CommandNotFinite
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_newton.errors import InvalidParameter

angles = st.floats(-20.0, 20.0)


def test_the_duty_is_the_bench_controllers() -> None:
    """Ten percent per radian, cut at ninety, and two percent on top."""
    loop = HostPositionLoop()
    assert loop.duty(3.0, 1.0) == pytest.approx(0.10 * 2.0 + 0.02)
    assert loop.duty(1.0, 3.0) == pytest.approx(-0.10 * 2.0 + 0.02)
    assert loop.duty(1.0, 1.0) == pytest.approx(0.02)
    assert HostPositionLoop(gain=1.0).duty(6.0, 1.0) == pytest.approx(0.92)


@given(command=angles, position=angles)
def test_no_duty_drives_the_spool_out_of_its_range(command: float, position: float) -> None:
    """Beyond an end the duty points back, and it never exceeds what the servo can give."""
    duty = HostPositionLoop().duty(command, position)
    assert abs(duty) <= 0.92 + 1e-12  # float64
    assert not (position >= 2.0 * pi and duty > 0.0)
    assert not (position <= 0.0 and duty < 0.0)


def test_a_command_that_is_no_number_is_refused() -> None:
    """NaN would pass every comparison."""
    with pytest.raises(CommandNotFinite, match="they are nan and 1"):
        HostPositionLoop().duty(nan, 1.0)


@pytest.mark.parametrize(
    "words",
    [
        {"gain": 0.0},
        {"gain": nan},
        {"duty_limit": 1.5},
        {"offset": 1},
        {"position_range": (1.0, 1.0)},
        {"position_range": (0.0, nan)},
    ],
)
def test_a_loop_that_cannot_hold_is_refused(words: dict) -> None:
    """A gain of zero, or an offset beyond the limit, holds nothing."""
    with pytest.raises(InvalidParameter):
        HostPositionLoop(**words)
