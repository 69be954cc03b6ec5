"""A family of servos: its protocol, its memory, and what must be set in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from tendon_hardware.servos.base import OverloadProtection, ServoSettings, ServoSpec
from tendon_hardware.servos.serial_bus.packets import Packets, Register
from tendon_hardware.servos.serial_bus.servo_port import PortHandler

WATCHDOG_PERIOD = 0.02  # Unit of a bus watchdog [s]
WATCHDOG_TRIPPED = -1  # Content of its register once it has stopped the servo


Targets = tuple[tuple[Register, int], ...]  # Registers with the counts that they must have


@dataclass(frozen=True, kw_only=True, slots=True)
class ControlTable:
    """Registers that every family has, each in its own place."""

    model: Register  # What the servo is
    identifier: Register  # ID on the bus
    baud_rate: Register  # Rate of the bus, as a code
    answers: Register  # Which instructions are answered
    answers_all: int  # Content of it at which every instruction is answered
    torque: Register  # Whether the motor is driven
    goal_duty: Register  # Duty that the motor is asked for
    position: Register
    velocity: Register
    current: Register
    duty: Register  # Duty that the motor has
    voltage: Register
    temperature: Register
    alerts: Register  # What has happened to the servo, bit by bit
    # RAM that decides nothing in our mode: a servo that has restarted has forgotten it
    mark: Register
    marked: int  # Content of it that no restart leaves
    # Silence after which the servo stops by itself [20 ms]; None where it never does
    watchdog: Register | None
    # 0 lets changes of the EEPROM outlast the power; None where they always do
    lock: Register | None
    counts_turns: bool  # Whether the position goes on over a turn; else it begins anew
    end: int  # First address behind the table

    @property
    def state(self) -> tuple[Register, Register, Register, Register]:
        """Registers that are read as one instant: duty, current, velocity and position."""
        return self.duty, self.current, self.velocity, self.position


class Reader(Protocol):
    """A bus on which one servo is read."""

    identifier: int
    baud: int  # Rate of the bus [1/s]

    def read(self, *registers: Register) -> tuple[int, ...]:
        """Read registers in one transaction."""
        ...


def read_each(bus: Reader, *registers: Register) -> dict[Register, int]:
    """Read registers in one transaction; return each one's counts."""
    return dict(zip(registers, bus.read(*registers), strict=True))


@dataclass(frozen=True, kw_only=True)
class ServoFamily:
    """All in which one family of servos differs from another."""

    packets: Callable[[PortHandler], Packets]
    table: ControlTable
    rates: Mapping[int, int]  # Rate of the bus [1/s] -> code in its register, likeliest first
    rates_sought: tuple[int, ...]  # Rates at which servos are looked for, likeliest first [1/s]
    # Registers that must be set before the motor runs, for a greatest duty [1]
    targets: Callable[[ServoSpec, float], Targets]
    # Reads back all that decides a step response
    read_settings: Callable[[Reader, ServoSpec, str | None], ServoSettings]
    # Counts of the data sheet's speed unit in a count of this servo's own [1]
    velocity_scale: Callable[[Reader], float]
    # Packet that switches the motor of an ID off; None where the servo has a watchdog
    motor_off: Callable[[int], bytes] | None
    # How a motor lets go that is given a duty and no rest from it; None where a watchdog does
    forgets: OverloadProtection | None
    alerts: Mapping[int, str]  # Words for the bits of the register of alerts
    remedy: str  # What ends an alert once its cause is gone
