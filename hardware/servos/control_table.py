"""What the driver needs of a servo's memory, wherever a family of servos keeps it."""

from dataclasses import dataclass

from hardware.servos.serial_bus.register import Register

WATCHDOG_PERIOD = 0.02
"""Unit of a bus watchdog [s]."""
WATCHDOG_TRIPPED = -1
"""Content of its register once it has stopped the servo."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ControlTable:
    """Registers that every family has, each in its own place."""

    model: Register
    """What the servo is."""
    identifier: Register
    """ID on the bus."""
    baud_rate: Register
    """Rate of the bus, as a code."""
    answers: Register
    """Which instructions are answered."""
    answers_all: int
    """Content of it at which every instruction is answered."""
    torque: Register
    """Whether the motor is driven."""
    goal_duty: Register
    """Duty that the motor is asked for."""
    position: Register
    velocity: Register
    current: Register
    voltage: Register
    temperature: Register
    alerts: Register
    """What has happened to the servo, bit by bit."""
    mark: Register
    """RAM that decides nothing in our mode: a servo that has restarted has forgotten it."""
    marked: int
    """Content of it that no restart leaves."""
    watchdog: Register | None
    """Silence after which the servo stops by itself [20 ms]; None where it never does."""
    lock: Register | None
    """0 lets changes of the EEPROM outlast the power; None where they always do."""
    counts_turns: bool
    """Whether the position goes on over a turn; else it begins anew."""
    end: int
    """First address behind the table."""

    @property
    def state(self) -> tuple[Register, Register, Register]:
        """Registers that are read as one instant: current, velocity and position."""
        return self.current, self.velocity, self.position
