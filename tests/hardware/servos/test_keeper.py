"""A servo without a watchdog has one beside the program that drives it."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from tendon_hardware.errors import WatchdogTripped
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.virtual_bench import FaultEvent, VirtualPorts

RETRIES = 8
DRIVE = """
import sys, time
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
servo = BusServo(SERVOS["sts3215"], sys.argv[1], retries=8)
servo.open()
servo.configure(watchdog_s=0.4)
servo.enable_torque()
servo.command_duty(0.05)
print("on", flush=True)
while True:
    servo.command_duty(0.05)
    time.sleep(0.01)
"""
"""Holds a tendon, and would for ever."""


@pytest.fixture(scope="module")
def ports() -> Iterator[VirtualPorts]:
    """One bench for all tests of this file."""
    with VirtualPorts("spring_weak", 1, servo="sts3215") as ports:
        yield ports


@pytest.fixture
def servo(ports: VirtualPorts) -> Iterator[BusServo]:
    """The driver of its servo, with its motor on."""
    servo = BusServo(SERVOS["sts3215"], ports.servo_port, retries=RETRIES)
    servo.open()
    servo.configure(watchdog_s=0.5)
    servo.enable_torque()
    yield servo
    servo.close()


def happens(true: Callable[[], bool], limit: float = 10.0) -> bool:
    """Tell whether something happens within a time [s]."""
    deadline = time.monotonic() + limit
    while not true():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def test_a_killed_program_leaves_no_motor_on(ports: VirtualPorts) -> None:
    """Killed without a word, its motor is on for no longer than its watchdog says."""
    program = subprocess.Popen(
        [sys.executable, "-c", DRIVE, ports.servo_port], stdout=subprocess.PIPE
    )
    with program:
        assert program.stdout.readline() == b"on\n"
        time.sleep(1.0)
        pulled = happens(lambda: ports.state().duty == pytest.approx(0.05))  # or it rests
        program.send_signal(signal.SIGKILL)
    assert pulled
    assert happens(lambda: ports.state().duty == 0.0)


def test_the_next_program_waits_until_the_motor_is_off(ports: VirtualPorts) -> None:
    """A dead program's keeper still writes for 0.2 s; nobody else has the port until it is done."""
    for _ in range(4):
        with subprocess.Popen(
            [sys.executable, "-c", DRIVE, ports.servo_port], stdout=subprocess.PIPE
        ) as program:
            assert program.stdout.readline() == b"on\n"
            program.send_signal(signal.SIGKILL)
        servo = BusServo(SERVOS["sts3215"], ports.servo_port, retries=RETRIES)
        servo.open()
        servo.configure(watchdog_s=2.0)
        servo.enable_torque()
        time.sleep(0.3)
        assert servo.check().torque_enabled
        assert servo.close()


def test_a_program_that_hangs_is_told_afterwards(servo: BusServo, ports: VirtualPorts) -> None:
    """The motor is off after its silence; the next goal says why, and it stays off until asked."""
    servo.command_duty(0.05)
    assert happens(lambda: ports.state().duty == 0.0)
    assert happens(lambda: servo.read_health().watchdog_tripped)
    with pytest.raises(WatchdogTripped, match=r"no instruction came for 0\.5 s"):
        servo.command_duty(0.05)
    with pytest.raises(WatchdogTripped):
        servo.check()
    servo.enable_torque()
    assert servo.command_duty(0.05) == 0.05
    assert servo.check().torque_enabled


def test_a_motor_that_is_switched_off_needs_no_keeper(servo: BusServo, ports: VirtualPorts) -> None:
    """Switched off in order, nothing writes to the port afterwards."""
    servo.disable_torque()
    time.sleep(0.8)
    assert not servo.read_health().watchdog_tripped
    servo.enable_torque()
    assert servo.close()
    assert ports.state().duty == 0.0


def test_a_cable_that_comes_back_finds_the_servo(servo: BusServo, ports: VirtualPorts) -> None:
    """Unplugged for longer than the watchdog, set up anew, and watched over again."""
    ports.plan(FaultEvent(name="unplug", duration=0.8))
    assert happens(lambda: not reads(servo))
    assert servo.reconnect(limit=20.0, resume_torque=True)
    assert servo.command_duty(0.05) == 0.05
    assert servo.check().torque_enabled


def reads(servo: BusServo) -> bool:
    """Tell whether a state is read."""
    from tendon_hardware.errors import HardwareFault

    try:
        servo.read_state()
    except HardwareFault:
        return False
    return True
