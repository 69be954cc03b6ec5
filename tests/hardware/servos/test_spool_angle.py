"""Turns of a spool across a restart of its servo."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.spool_angle import SpoolAngle

SPEC = SERVOS["xc330_t288_t"]
TURN = SPEC.counts_per_turn


def counts(home: int, angle: float) -> int:
    """Return what the register holds at an angle [rad]."""
    return home + round(angle / SPEC.position_unit)


@given(home=st.integers(-100_000, 100_000), angle=st.floats(-20.0, 20.0))
def test_angles_are_counted_from_home(home: int, angle: float) -> None:
    """To counts and back, to half a count; home is zero."""
    spool = SpoolAngle(SPEC)
    assert not spool.has_home
    spool.set_home(home, 0.0)
    assert spool.angle(home) == 0.0
    assert spool.angle(counts(home, angle)) == pytest.approx(angle, abs=0.51 * SPEC.position_unit)


@given(
    home=st.integers(0, TURN - 1),
    last=st.floats(0.0, 2.0 * pi),
    moved=st.floats(1.0 - 2.0 * pi + 0.01, 0.99),
)
def test_a_restart_loses_no_turn(home: int, last: float, moved: float) -> None:
    """The register is cut to one turn; the spool has unwound by up to 5.3 rad, or wound by 1."""
    spool = SpoolAngle(SPEC)
    spool.set_home(home, 0.0)
    last = spool.angle(counts(home, last))
    now = counts(home, last + moved)
    spool.restore_turns(now % TURN)
    assert spool.angle(now % TURN) == pytest.approx(last + moved, abs=SPEC.position_unit)


@given(home=st.integers(0, TURN - 1), steps=st.lists(st.floats(-3.1, 3.1), max_size=30))
def test_a_register_of_one_turn_is_followed(home: int, steps: list[float]) -> None:
    """Steps of less than half a turn add up, however often the register begins anew."""
    spool = SpoolAngle(SPEC, counts_turns=False)
    spool.set_home(home, 0.0)
    angle = 0.0
    for step in steps:
        angle += step
        read = spool.angle(counts(home, angle) % TURN)
        assert read == pytest.approx(angle, abs=0.51 * SPEC.position_unit)
