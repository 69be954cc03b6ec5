"""A family of servos: its protocol, its memory, and what must be set in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from hardware.servos.base import ServoSettings, ServoSpec
from hardware.servos.control_table import ControlTable
from hardware.servos.serial_bus.packets import Packets
from hardware.servos.serial_bus.register import Register
from hardware.servos.serial_bus.servo_port import PortHandler


class Reader(Protocol):
    """A bus on which one servo is read."""

    identifier: int

    @property
    def baud(self) -> int:
        """Rate of the bus [1/s]."""
        ...

    def read(self, *registers: Register) -> tuple[int, ...]:
        """Read registers in one transaction."""
        ...


@dataclass(frozen=True, kw_only=True)
class ServoFamily:
    """All in which one family of servos differs from another."""

    packets: Callable[[PortHandler], Packets]
    table: ControlTable
    rates: Mapping[int, int]
    """Rate of the bus [1/s] -> code in its register, likeliest first."""
    rates_sought: tuple[int, ...]
    """Rates at which servos are looked for, likeliest first [1/s]."""
    targets: Callable[[ServoSpec], tuple[tuple[Register, int], ...]]
    """Registers that must be set before the motor runs, with their counts."""
    read_settings: Callable[[Reader, ServoSpec, str | None], ServoSettings]
    """Reads back all that decides a step response."""
    velocity_scale: Callable[[Reader], float]
    """Counts of the data sheet's speed unit in a count of this servo's own [1]."""
    motor_off: Callable[[int], bytes] | None
    """Packet that switches the motor of an ID off; None where the servo has a watchdog."""
    remedy: str
    """What ends an alert once its cause is gone."""
