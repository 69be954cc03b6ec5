"""Every servo in the table agrees with its data sheet."""

from math import nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import CommandNotFinite
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import alert_words
from tendon_hardware.servos.dynamixel.dynamixel_registers import TABLE
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.host_position_loop import HostPositionLoop
from tendon_hardware.servos.spool_angle import SpoolAngle
from tendon_newton.errors import InvalidParameter

# rows of the data sheets: model number, no-load speed [rev/min], stall torque [N m], voltage,
# greatest speed [counts] after a reset, which the data sheet sets just beyond the no-load speed
DATA_SHEET = {
    "sts3215": (777, 45.0, 30.0 * 0.0980665, 12.0, 68 * 50),
    "sts3250": (2825, 60.0 / (6.0 * 0.133), 50.0 * 0.0980665, 12.0, 5200),
    "xc330_t288_t": (1220, 65.0, 0.92, 11.1, 320),
    "xl330_m288_t": (1200, 103.0, 0.52, 5.0, 445),
}

# units of a count of speed [rev/min] and of duty [%], by family
UNITS = {"dynamixel": (0.229, 0.113), "feetech": (0.01465, 0.1)}

every_servo = pytest.mark.parametrize("name", SERVOS)


@every_servo
def test_a_servo_stands_under_its_own_name_with_its_row(name: str) -> None:
    """Name, model number, speed, torque and voltage are those of the data sheet."""
    spec = SERVOS[name]
    model, speed, torque, voltage, _ = DATA_SHEET[name]
    assert (spec.name, spec.model_number) == (name, model)
    assert spec.no_load_speed == pytest.approx(speed * 2.0 * pi / 60.0)
    assert spec.stall_torque == pytest.approx(torque, abs=5e-3)  # printed digits
    assert spec.supply_voltage == voltage
    low, high = spec.supply_range
    assert low < spec.supply_voltage <= high


@every_servo
def test_counts_become_the_units_of_the_data_sheet(name: str) -> None:
    """A count is 0.088 degrees; those of speed and duty are the family's."""
    spec = SERVOS[name]
    assert spec.counts_per_turn == 4096
    assert spec.position_unit * 180.0 / pi == pytest.approx(0.088, abs=2e-4)  # printed digits
    speed, duty = UNITS[spec.family]
    assert spec.velocity_unit * 60.0 / (2.0 * pi) == pytest.approx(speed, rel=1e-3)
    assert 100.0 / spec.duty_counts == pytest.approx(duty, abs=5e-4)  # printed digits
    limit = DATA_SHEET[name][4] * spec.velocity_unit
    assert 0.9 < limit / spec.no_load_speed < 1.2


@given(current=st.integers(-0x8000, 0x7FFF), position=st.integers(-(2**31), 2**31 - 1))
def test_signed_registers_keep_their_sign(current: int, position: int) -> None:
    """Two's complement in little endian, which the SDK leaves undone."""
    assert TABLE.current.decode(TABLE.current.encode(current)) == current
    assert TABLE.position.decode(TABLE.position.encode(position)) == position
    assert TABLE.current.decode(b"\xff\xff") == -1


def test_the_state_is_one_block_of_twelve_bytes() -> None:
    """Duty, current, velocity and position stand side by side from 124 to 135."""
    assert TABLE.state[0].address == 124
    for left, right in zip(TABLE.state, TABLE.state[1:], strict=False):
        assert left.address + left.size == right.address
    assert sum(register.size for register in TABLE.state) == 12


def test_alerts_have_words() -> None:
    """The bits of register 70, not those of 63, which is a mask."""
    words = FAMILIES["dynamixel"].alerts
    assert alert_words(0, words) == ()
    assert alert_words(0x20, words) == ("overload",)
    assert alert_words(0x05, words) == ("input voltage outside its limits", "overheating")
    assert alert_words(0x40, words) == ("unknown alert, bit 6",)


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
