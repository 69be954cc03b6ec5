"""The emulated servo under the real SDK: access, limits, watchdog, alerts, restart."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tendon_hardware.virtual_bench import FaultEvent
from tendon_hardware.virtual_bench.memory.control_table import XL330_M288_T
from tendon_hardware.virtual_bench.memory.protocol import frame
from tests.hardware.virtual_bench.link import (
    EXTENDED,
    ID,
    MODE,
    POSITION,
    PWM,
    PWM_GOAL,
    SILENT,
    SUCCESS,
    TORQUE,
    Link,
)

BAD_RANGE, BAD_LENGTH, BEYOND_LIMIT, NO_ACCESS, ALERT = 4, 5, 6, 7, 0x80
WATCHDOG, HARDWARE_ERROR = 98, 70


@pytest.fixture
def link() -> Link:
    """A finger, torque off."""
    return Link()


def test_ping_tells_the_model(link) -> None:
    """A ping gives 1220, a broadcast ping also the firmware; an XL330 says 1200."""
    assert link.ping() == (1220, SUCCESS, 0)
    assert link.sdk.broadcastPing(link.port) == ({ID: [1220, 52]}, SUCCESS)
    assert Link(model=XL330_M288_T).ping() == (1200, SUCCESS, 0)


def test_factory_values_are_the_manuals(link) -> None:
    """What the e-manual's table gives as initial values is what a driver reads."""
    table = {9: (1, 250), 36: (2, 885), 38: (2, 910), 44: (4, 320), 63: (1, 52), 84: (2, 900)}
    assert {a: link.read(a, n) for a, (n, _) in table.items()} == {
        a: value for a, (_, value) in table.items()
    }


@pytest.mark.parametrize(
    ("address", "size", "value", "error"),
    [
        (MODE, 1, 2, BAD_RANGE),
        (POSITION, 4, 0, NO_ACCESS),
        (PWM_GOAL, 1, 100, BAD_LENGTH),
        (PWM_GOAL, 2, 886, BAD_RANGE),
        (14, 1, 0, NO_ACCESS),
        (65, 1, 1, 0),
    ],
)
def test_a_write_is_refused_with_the_manuals_error(link, address, size, value, error) -> None:
    """Range 4, length 5, limit 6 and access 7 are told apart; a legal write has no error."""
    assert link.write(address, size, value) == error


def test_a_limit_that_was_set_is_kept(link) -> None:
    """A goal beyond a limit in another register is error 6, and the old goal stays."""
    assert link.write(36, 2, 400) == 0
    link.enable(PWM)
    assert link.write(PWM_GOAL, 2, 401) == BEYOND_LIMIT
    assert link.write(PWM_GOAL, 2, -400) == 0


def test_eeprom_is_locked_while_torque_is_on(link) -> None:
    """The mode cannot change under torque: error 7, and it has not changed."""
    link.enable(EXTENDED)
    assert link.write(MODE, 1, PWM) == NO_ACCESS
    assert link.read(MODE, 1) == EXTENDED


def test_the_watchdog_trips_latches_and_is_cleared(link) -> None:
    """200 ms of silence: 98 is 255, the motor stops, goals are refused until 0 is written."""
    link.enable(PWM)
    assert link.write(WATCHDOG, 1, 10) == 0
    link.write(PWM_GOAL, 2, 100)
    for _ in range(20):  # any instruction feeds it
        link.wait(0.1)
        assert link.read(WATCHDOG, 1) == 10
    link.wait(0.25)
    assert link.read(WATCHDOG, 1) == 255
    assert link.bench.state().duty == 0.0
    assert link.write(PWM_GOAL, 2, 100) == BAD_RANGE
    assert link.write(WATCHDOG, 1, 0) == 0
    assert link.write(PWM_GOAL, 2, 100) == 0


def test_an_alert_shuts_down_until_a_reboot(link) -> None:
    """An overload sets the alert bit in every answer and switches off; only a reboot helps."""
    link.enable(EXTENDED)
    link.bench.plan(FaultEvent(name="alert", alert="overload"))
    link.wait(0.01)
    assert link.ping() == (1220, SUCCESS, ALERT)
    data, result, error = link.sdk.read1ByteTxRx(link.port, ID, HARDWARE_ERROR)
    assert (data, result, error) == (0x20, SUCCESS, ALERT)
    assert link.sdk.write1ByteTxRx(link.port, ID, TORQUE, 1) == (SUCCESS, NO_ACCESS | ALERT)
    assert link.sdk.reboot(link.port, ID) == (SUCCESS, 0)
    assert link.ping()[1] == SILENT  # it starts up
    link.wait(0.3)
    assert link.read(HARDWARE_ERROR, 1) == 0
    assert link.read(TORQUE, 1) == 0


def test_an_alert_outside_the_shutdown_mask_leaves_torque_on(link) -> None:
    """Input voltage is no part of the mask 52: the bit shows, the motor goes on."""
    link.enable(EXTENDED)
    link.bench.plan(FaultEvent(name="alert", alert="input_voltage"))
    link.wait(0.01)
    assert link.sdk.read1ByteTxRx(link.port, ID, TORQUE) == (1, SUCCESS, ALERT)


def test_a_reboot_forgets_ram_and_turns_but_keeps_eeprom(link) -> None:
    """Gains fall back, the mode stays, and the position starts within one turn."""
    link.write(MODE, 1, EXTENDED)
    link.write(84, 2, 123)
    link.bench.plant.encoder.home += 2 * 4096  # two turns with the tendon unhooked
    link.wait(0.05)
    assert link.read(POSITION, 4) > 4096
    link.sdk.reboot(link.port, ID)
    link.wait(0.5)
    assert link.read(84, 2) == 900
    assert link.read(MODE, 1) == EXTENDED
    assert link.read(POSITION, 4) < 4096


def test_the_status_return_level_silences_answers(link) -> None:
    """At level 1 a write is carried out without an answer; a read still answers."""
    link.write(68, 1, 1)
    assert link.sdk.write1ByteTxRx(link.port, ID, 65, 1)[0] == SILENT
    assert link.read(65, 1) == 1


def test_the_tick_counts_milliseconds(link) -> None:
    """Register 120 advances by the milliseconds that pass, by its own clock to 0.2 %."""
    before = link.read(120, 2)
    link.wait(1.0)
    assert link.read(120, 2) - before == pytest.approx(1001, abs=3)


BATTERED = Link()  # Kept over all examples, so that one finds what an earlier one has left behind


@settings(max_examples=150)
@given(
    frames=st.lists(
        st.tuples(
            st.sampled_from([1, 2, 3, 4, 5, 6, 8, 0x82, 0x83, 0x92, 0x93, 0x10, 0xFF]),
            st.integers(0, 230),
            st.binary(max_size=12),
        ),
        max_size=12,
    ),
    broadcast=st.booleans(),
    soup=st.binary(max_size=40),
)
def test_no_instruction_brings_the_servo_down(frames, broadcast, soup) -> None:
    """Whole frames with any contents and bytes without sense are answered or ignored, no more."""
    bench = BATTERED.bench
    for code, address, rest in frames:
        data = address.to_bytes(2, "little") + rest
        bench.receive(frame(0xFE if broadcast else ID, code, data), bench.time)
    bench.receive(soup, bench.time)
    bench.advance(bench.time + 0.01)
    assert math.isfinite(bench.state().tension)
