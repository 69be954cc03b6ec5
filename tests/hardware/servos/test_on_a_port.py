"""The driver over a real serial port, with the bench as a process at its other end.

What is slow here is not the code: the machine may give the other process its turn late. Three
attempts of 4 ms are too few for a busy one, hence the retries.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tendon_hardware.errors import PortBusy, PortLost, PortUnavailable, ServoSilent
from tendon_hardware.serial_ports import PortLock, holders, latency_timer, lock_path
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.virtual_bench import FaultEvent, VirtualPorts
from tests.interpreters import python

RETRIES = 20


@pytest.fixture(scope="module")
def ports() -> Iterator[VirtualPorts]:
    """One bench for all tests of this file."""
    with VirtualPorts("spring_weak", 1) as ports:
        yield ports


@pytest.fixture
def servo(ports: VirtualPorts) -> Iterator[BusServo]:
    """The driver of its servo, open."""
    servo = BusServo(SERVOS["xc330_t288_t"], ports.servo_port, retries=RETRIES)
    servo.open()
    yield servo
    servo.close()


def test_the_sdk_drives_the_servo_over_a_port(servo: BusServo, ports: VirtualPorts) -> None:
    """Set, switched on, moved, read and switched off."""
    servo.configure(watchdog_s=2.0)
    servo.enable_torque()
    servo.command_duty(0.3)
    deadline = time.monotonic() + 5.0
    while servo.read_state().position < 0.8 and time.monotonic() < deadline:
        time.sleep(0.02)
    assert servo.read_state().position >= 0.8
    assert servo.settings().latency_timer is None  # a pseudo-terminal has none
    assert servo.close()


def test_a_second_program_is_told_who_has_the_port(servo: BusServo, ports: VirtualPorts) -> None:
    """Two openers would take each other's answers; the message names the process."""
    code = (
        "import sys; from tendon_hardware.servos import SERVOS;"
        "from tendon_hardware.servos.bus_servo import BusServo;"
        "BusServo(SERVOS['xc330_t288_t'], sys.argv[1]).open()"
    )
    second = python("-c", code, ports.servo_port)
    assert f"PortBusy: {ports.servo_port}: held by process {os.getpid()}" in second.stderr
    servo.read_state()
    with pytest.raises(PortBusy, match=f"held by process {os.getpid()}"):
        PortLock(ports.servo_port).acquire()


def test_a_killed_program_gives_the_port_back(ports: VirtualPorts) -> None:
    """The system releases the lock of a dead process."""
    code = (
        "import sys, time; from tendon_hardware.serial_ports import PortLock;"
        "PortLock(sys.argv[1]).acquire(); print('held', flush=True); time.sleep(60)"
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", code, ports.servo_port], stdout=subprocess.PIPE
    )
    with holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(PortBusy, match=f"held by process {holder.pid}"):
            PortLock(ports.servo_port).acquire()
        holder.send_signal(signal.SIGKILL)
    lock = PortLock(ports.servo_port)
    lock.acquire()
    lock.release()
    lock.release()


def test_an_unplugged_adapter_is_lost_and_found(servo: BusServo, ports: VirtualPorts) -> None:
    """The kernel's own error comes through, and the port works again afterwards."""
    servo.configure(watchdog_s=2.0)
    servo.enable_torque()
    ports.plan(FaultEvent(name="unplug", duration=0.6))
    with pytest.raises((PortLost, ServoSilent)):
        read_for(servo, 5.0)
    assert servo.reconnect(limit=20.0, resume_torque=True)
    assert servo.check().torque_enabled
    assert servo.counters.reconnects == 1


def read_for(servo: BusServo, seconds: float) -> None:
    """Read states for a time [s]."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        servo.read_state()


def test_an_interrupt_in_a_transaction_does_not_block_the_port(servo: BusServo) -> None:
    """The SDK leaves a port that was interrupted as in use, for ever."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGALRM, interrupt)
    interrupted = 0
    try:
        for k in range(20):
            signal.setitimer(signal.ITIMER_REAL, 2e-4 * (1 + k))
            try:
                for _ in range(50):
                    servo.read_state()
            except KeyboardInterrupt:
                interrupted += 1
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        signal.signal(signal.SIGALRM, previous)
    assert interrupted > 10
    servo.read_state()


def test_a_port_that_is_not_there_is_named() -> None:
    """No traceback of the SDK."""
    with pytest.raises(PortUnavailable, match="/dev/no_such_port: no such port"):
        BusServo(SERVOS["xc330_t288_t"], "/dev/no_such_port").open()


def test_a_rate_that_the_sdk_lacks_is_named(ports: VirtualPorts) -> None:
    """4.5 Mbit/s, which a tool once set, is beyond its list."""
    servo = BusServo(SERVOS["xc330_t288_t"], ports.servo_port, baud=4_500_000)
    with pytest.raises(PortUnavailable, match="no rate of 4500000 baud"):
        servo.open()


def test_the_sdk_is_told_the_latency_of_the_adapter(servo: BusServo) -> None:
    """Else every lost answer costs 36 ms, three ticks of a loop at 80 Hz."""
    from dynamixel_sdk import port_handler

    assert port_handler.LATENCY_TIMER == 1


def test_processes_that_hold_a_port_are_found(ports: VirtualPorts) -> None:
    """The bench itself keeps the terminal open."""
    assert ports.process_id in [number for number, _ in holders(ports.servo_port)]
    assert latency_timer(ports.servo_port) is None
    assert lock_path(ports.servo_port).name.startswith("tendon-newton.pts_")
