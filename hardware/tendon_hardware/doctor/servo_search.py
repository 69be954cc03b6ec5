"""Servos: found at whatever rate they answer, set to another one, and restarted."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import zip_longest

from tendon_hardware.clock import Clock
from tendon_hardware.doctor.observation import Observation, observed
from tendon_hardware.errors import ServoSilent
from tendon_hardware.servos.base import ServoCounters
from tendon_hardware.servos.bus import Bus
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.serial_bus.packets import Register
from tendon_hardware.servos.serial_bus.servo_port import PortHandler

LAST_IDENTIFIER = 252
"""Greatest ID that a servo can have; those above mean something else on the bus."""
RETRIES = 20  # More than a loop can afford: a bad bus is to be described, not given up on
RESTART_PAUSE = 0.5  # Time that a restarted servo is left alone [s]; it takes some tenths
SETTING_PAUSE = 0.1  # Time in which a servo takes another ID or rate [s]


@dataclass(frozen=True, kw_only=True)
class FoundServo:
    """Servos that answer on a port."""

    family: str
    rate: int  # Rate of the bus [1/s]
    models: dict[int, int]  # Model numbers by ID


def sought() -> tuple[tuple[str, int], ...]:
    """Return families and rates [1/s] at which servos are looked for, likeliest first."""
    return tuple(
        (name, rate)
        for each in zip_longest(*(family.rates_sought for family in FAMILIES.values()))
        for name, rate in zip(FAMILIES, each, strict=True)
        if rate is not None
    )


def port_name(port: str | PortHandler) -> str:
    """Return what a port is called in messages."""
    return port if isinstance(port, str) else "the virtual bench"


def find_servos(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None]
) -> FoundServo | None:
    """Return the servos of the first family and rate that answer."""
    for family, rate in sought():
        show(f"looking for {family} servos on {port_name(port)} at {rate} baud")
        with opened(port, clock, family, 1, rate, retries=0) as bus:
            models = bus.find_all()
        if models:
            return FoundServo(family=family, rate=rate, models=models)
    return None


@contextmanager
def opened(
    port: str | PortHandler,
    clock: Clock,
    family: str,
    identifier: int,
    rate: int,
    retries: int = RETRIES,
) -> Generator[Bus]:
    """Open a bus for one servo, and close it."""
    bus = Bus(
        port,
        family=FAMILIES[family],
        identifier=identifier,
        baud=rate,
        clock=clock,
        counters=ServoCounters(),
        retries=retries,
    )
    bus.port.open()
    try:
        yield bus
    finally:
        bus.port.close()


def set_baud(
    port: str | PortHandler, baud: int, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Set the rate of the only servo on a port, which it keeps.

    Raises:
        ServoSilent: None answers, or more than one, or not at the new rate.
    """
    found = find_servos(port, clock, show)
    codes = FAMILIES[found.family if found else next(iter(FAMILIES))].rates
    listed = ", ".join(str(rate) for rate in sorted(codes))
    wanted = f"set to one of {listed} baud; asked for {baud}"
    found, identifier = only_servo(port, found, wanted, allowed=baud in codes)
    register = FAMILIES[found.family].table.baud_rate
    change(port, clock, found, register, codes[baud], identifier=identifier, rate=baud)
    return observed(
        "good", f"servo {identifier}", f"set from {found.rate} to {baud} baud, and answers"
    )


def set_identifier(
    port: str | PortHandler, identifier: int, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Set the ID of the only servo on a port, which it keeps: on one bus each has its own.

    Raises:
        ServoSilent: None answers, or more than one, or not by the new ID.
    """
    wanted = f"given an ID of 0 to {LAST_IDENTIFIER}; asked for {identifier}"
    allowed = 0 <= identifier <= LAST_IDENTIFIER
    found, before = only_servo(port, find_servos(port, clock, show), wanted, allowed=allowed)
    register = FAMILIES[found.family].table.identifier
    change(port, clock, found, register, identifier, identifier=identifier, rate=found.rate)
    return observed("good", f"servo {before}", f"has the ID {identifier}, and answers")


def only_servo(
    port: str | PortHandler, found: FoundServo | None, wanted: str, *, allowed: bool
) -> tuple[FoundServo, int]:
    """Return the only servo on a port and its ID, where it may be set to what is wanted."""
    if found is None or len(found.models) != 1 or not allowed:
        raise ServoSilent(
            f"{port_name(port)}: one servo must answer to be {wanted}, and "
            f"{len(found.models) if found else 0} answer"
        )
    return found, next(iter(found.models))


def change(
    port: str | PortHandler,
    clock: Clock,
    found: FoundServo,
    register: Register,
    counts: int,
    *,
    identifier: int,
    rate: int,
) -> None:
    """Write the ID or rate of the only servo, and make sure that it answers to the new one."""
    (before,) = found.models
    lock = FAMILIES[found.family].table.lock
    with opened(port, clock, found.family, before, found.rate) as bus:
        bus.write(bus.table.torque, 0)  # else the EEPROM is locked
        if lock is not None:
            bus.write(lock, 0)
        bus.write_unanswered(register, counts)
        clock.sleep_until(clock.now() + SETTING_PAUSE)
    with opened(port, clock, found.family, identifier, rate) as bus:
        bus.ping()
        if lock is not None:
            bus.write(lock, 1)


def reboot_servos(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Restart all servos on a port, which clears their alerts and switches their motors off.

    Raises:
        ServoSilent: None answers.
        ServoRefused: Their family cannot be restarted over the bus.
    """
    found = find_servos(port, clock, show)
    if found is None:
        raise ServoSilent(f"{port_name(port)}: a servo must answer to be restarted; none does")
    for identifier in found.models:
        with opened(port, clock, found.family, identifier, found.rate) as bus:
            bus.reboot()
            clock.sleep_until(clock.now() + RESTART_PAUSE)
    listed = ", ".join(str(identifier) for identifier in found.models)
    return observed("good", "servo", f"restarted: {listed}")
