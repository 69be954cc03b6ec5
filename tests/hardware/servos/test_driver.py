"""What the driver does with a servo that works."""

from math import nan
from types import SimpleNamespace
from typing import cast

import pytest

from tendon_hardware.errors import (
    CommandNotFinite,
    ServoAlert,
    ServoSilent,
    SettingMismatch,
    UnsupportedServo,
)
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import PositionGains
from tendon_hardware.servos.bus import Bus
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.dynamixel.dynamixel_registers import TABLE
from tendon_hardware.servos.setting_up import set_verified
from tendon_hardware.virtual_bench import LockstepBench
from tendon_hardware.virtual_bench.emulation.emulations import SERVO_MODELS
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.errors import InvalidParameter
from tests.hardware.servos.virtual_servo import LOOP, VirtualServo

TORQUE, WATCHDOG, MODE, P_GAIN = 64, 98, 11, 84


def test_a_duty_winds_in_and_is_limited() -> None:
    """The host decides; positive pulls the tendon in; what is cut is counted, NaN refused."""
    rig = VirtualServo()
    assert rig.servo.command_duty(2.0) == 1.0
    assert rig.servo.counters.limited == 1
    with pytest.raises(CommandNotFinite):
        rig.servo.command_duty(nan)
    for _ in range(20):
        rig.servo.command_duty(0.2)
        rig.wait(0.05)
    assert rig.servo.read_state().position > 0.1
    assert rig.register(MODE) == 16


def test_state_times_are_the_middle_of_the_transaction() -> None:
    """The instant lies between asking and having."""
    rig = VirtualServo()
    before = rig.clock.now()
    state = rig.servo.read_state()
    assert before < state.time < rig.clock.now()
    assert state.time == pytest.approx(0.5 * (before + rig.clock.now()))


def test_the_watchdog_is_armed_before_the_motor_runs() -> None:
    """200 ms are ten of its units; configured alone it is off."""
    rig = VirtualServo()
    assert (rig.register(WATCHDOG), rig.register(TORQUE)) == (10, 1)
    rig.servo.disable_torque()
    assert rig.register(TORQUE) == 0


def test_switching_on_moves_nothing() -> None:
    """The first goal is no duty."""
    rig = VirtualServo()
    rig.run(1.5, 1.5)
    rig.servo.disable_torque()
    rig.wait(1.0)  # the tendon unwinds what it can
    before = rig.servo.read_state().position
    rig.servo.enable_torque()
    rig.wait(0.15)
    assert rig.servo.read_state().position == pytest.approx(before, abs=0.02)


@pytest.mark.parametrize("address", [MODE, P_GAIN, 36])
def test_a_setting_that_differs_keeps_the_motor_off(address: int) -> None:
    """Somebody has changed a register since it was set."""
    rig = VirtualServo()
    rig.servo.disable_torque()
    rig.corrupt(address, 1)
    with pytest.raises(SettingMismatch, match=rf"\({address}\) must be \d+ .* it reads 1"):
        rig.servo.enable_torque()
    assert rig.register(TORQUE) == 0


def test_a_register_that_takes_nothing_is_named() -> None:
    """What was written is read back at once."""
    deaf = cast("Bus", SimpleNamespace(identifier=1, write=lambda *_: None, read=lambda _: (0,)))
    with pytest.raises(SettingMismatch, match=r"Torque Enable \(64\) must be 1 .* it reads 0"):
        set_verified(deaf, TABLE.torque, 1)


def test_an_unconfigured_servo_is_not_driven() -> None:
    """No limits, no watchdog, no motor."""
    bench = LockstepBench(draw_unit("finger", 3))
    servo = BusServo(SERVOS["xc330_t288_t"], bench.servo_port(), clock=bench.clock)
    servo.open()
    with pytest.raises(SettingMismatch, match="must be configured"):
        servo.enable_torque()


@pytest.mark.parametrize("name", SERVOS)
def test_every_servo_in_the_table_is_driven(name: str) -> None:
    """Found, set, switched on, moved and switched off, with its own gain and limits."""
    (model,) = (m for m in SERVO_MODELS.values() if m.number == SERVOS[name].model_number)
    bench = LockstepBench(draw_unit("finger", 3, model.name), model=model)
    servo = BusServo(SERVOS[name], bench.servo_port(), clock=bench.clock)
    servo.open()
    settings = servo.configure()
    assert settings.gains.proportional == SERVOS[name].position_gain
    assert settings.current_limit == pytest.approx(SERVOS[name].current_limit)
    servo.enable_torque()
    for _ in range(100):
        servo.command_duty(LOOP.duty(1.0, servo.read_state().position))
        bench.clock.sleep_until(bench.clock.now() + 0.0125)
    assert servo.read_state().position == pytest.approx(1.0, abs=0.3)
    assert servo.close()


@pytest.mark.parametrize("watchdog", [0.0, 3.0])
def test_a_configuration_without_watchdog_is_refused(watchdog: float) -> None:
    """Nothing else stops the motor of a program that is gone."""
    with pytest.raises(InvalidParameter, match=r"0\.02 to 2\.54 s"):
        VirtualServo().servo.configure(watchdog_s=watchdog)


def test_a_servo_that_another_program_left_is_taken_over() -> None:
    """Reversed, in another mode, answering pings alone, its motor on and its watchdog tripped."""
    rig = VirtualServo()
    for address, counts in ((10, 1), (MODE, 4), (98, 255), (TORQUE, 1), (68, 0), (9, 250)):
        rig.corrupt(address, counts)
    servo = BusServo(SERVOS["xc330_t288_t"], rig.bench.servo_port(), clock=rig.clock)
    servo.open()
    assert rig.register(68) == 2
    settings = servo.configure()
    assert (settings.operating_mode, settings.drive_mode, settings.return_delay) == (16, 0, 0.0)
    assert (rig.register(TORQUE), rig.register(WATCHDOG)) == (0, 0)
    servo.enable_torque()
    assert servo.check().torque_enabled


@pytest.mark.parametrize(
    ("name", "baud", "error", "said"),
    [
        ("xl330_m288_t", 1_000_000, UnsupportedServo, "model 1220, xc330_t288_t"),
        ("xc330_t288_t", 57_600, ServoSilent, "at 57600 baud; 3 attempts gave 3 times nothing"),
    ],
)
def test_a_servo_that_is_not_there_is_told_by_name_or_rate(name, baud, error, said) -> None:
    """The data sheet of another model would give wrong units; at another rate nothing answers."""
    bench = LockstepBench(draw_unit("finger", 3))
    servo = BusServo(SERVOS[name], bench.servo_port(), clock=bench.clock, baud=baud)
    with pytest.raises(error, match=said):
        servo.open()


def test_settings_for_the_log_are_read_back() -> None:
    """All that decides the step response, in SI units."""
    rig = VirtualServo()
    settings = rig.servo.settings()
    assert (settings.model, settings.operating_mode, settings.baud) == ("xc330_t288_t", 16, 10**6)
    assert settings.gains == PositionGains(proportional=900)
    assert settings.return_delay == 0.0
    assert settings.watchdog == pytest.approx(0.2)
    assert settings.duty_limit == 1.0


def test_an_alert_does_not_keep_the_motor_on() -> None:
    """A write is answered with the alert bit, and was done all the same."""
    rig = VirtualServo()
    rig.corrupt(63, 0)  # no alert stops the motor by itself
    rig.let("alert")
    assert rig.register(TORQUE) == 1
    with pytest.raises(ServoAlert, match=r"overload \(register 70 is 32\)"):
        rig.servo.check()
    assert rig.servo.counters.alerts > 0
    rig.servo.disable_torque()
    assert rig.register(TORQUE) == 0
    with pytest.raises(ServoAlert, match="reboot"):
        rig.servo.enable_torque()
