"""Servos: found at whatever rate they answer, set to another one, and restarted."""

from __future__ import annotations

from collections.abc import Callable

from hardware.clock import Clock
from hardware.doctor.observation import Observation
from hardware.errors import ServoSilent
from hardware.servos import registers as r
from hardware.servos.base import ServoCounters
from hardware.servos.bus import Bus
from hardware.servos.servo_port import PortHandler

RATES = (1_000_000, 57_600, 2_000_000, 3_000_000, 4_000_000, 115_200)
"""Rates at which servos are looked for, likeliest first [1/s]."""
LAST_IDENTIFIER = 252
"""Greatest ID that a servo can have; those above mean something else on the bus."""
RETRIES = 20
"""More than a loop can afford: a bad bus is to be described, not given up on."""
RESTART_PAUSE = 0.5
"""Time that a restarted servo is left alone [s]; it takes some tenths."""


def port_name(port: str | PortHandler) -> str:
    """Return what a port is called in messages."""
    return port if isinstance(port, str) else "the virtual bench"


def find_servos(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None]
) -> tuple[int, dict[int, int]] | None:
    """Return the first rate [1/s] at which servos answer, and their models by ID."""
    for rate in RATES:
        show(f"looking for servos on {port_name(port)} at {rate} baud")
        bus = Bus(port, identifier=1, baud=rate, clock=clock, counters=ServoCounters(), retries=0)
        bus.open()
        try:
            found = bus.find_all()
        finally:
            bus.close()
        if found:
            return rate, found
    return None


def set_baud(
    port: str | PortHandler, baud: int, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Set the rate of the only servo on a port, which it keeps.

    Raises:
        ServoSilent: None answers, or more than one, or not at the new rate.
    """
    codes = {57_600: 1, 115_200: 2, 1_000_000: 3, 2_000_000: 4, 3_000_000: 5, 4_000_000: 6}
    found = find_servos(port, clock, show)
    if found is None or len(found[1]) != 1 or baud not in codes:
        listed = ", ".join(str(rate) for rate in codes)
        raise ServoSilent(
            f"{port_name(port)}: one servo must answer to be set to one of {listed} baud; "
            f"asked for {baud}, and {len(found[1]) if found else 0} answer"
        )
    (identifier,) = found[1]
    counters = ServoCounters()
    for rate in (found[0], baud):
        bus = Bus(
            port, identifier=identifier, baud=rate, clock=clock, counters=counters, retries=RETRIES
        )
        bus.open()
        try:
            if rate == found[0]:
                bus.write(r.TORQUE_ENABLE, 0)  # else the EEPROM is locked
                bus.write_unanswered(r.BAUD_RATE, codes[baud])
                clock.sleep_until(clock.now() + 0.1)
            else:
                bus.ping()
        finally:
            bus.close()
    return Observation(
        subject=f"servo {identifier}",
        verdict="good",
        found=f"set from {found[0]} to {baud} baud, and answers",
    )


def set_identifier(
    port: str | PortHandler, identifier: int, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Set the ID of the only servo on a port, which it keeps: on one bus each has its own.

    Raises:
        ServoSilent: None answers, or more than one, or not by the new ID.
    """
    found = find_servos(port, clock, show)
    if found is None or len(found[1]) != 1 or not 0 <= identifier <= LAST_IDENTIFIER:
        raise ServoSilent(
            f"{port_name(port)}: one servo must answer to be given an ID of 0 to "
            f"{LAST_IDENTIFIER}; asked for {identifier}, and {len(found[1]) if found else 0} answer"
        )
    rate, (before,) = found[0], found[1]
    for each in (before, identifier):
        bus = Bus(
            port, identifier=each, baud=rate, clock=clock, counters=ServoCounters(), retries=RETRIES
        )
        bus.open()
        try:
            if each != identifier:
                bus.write(r.TORQUE_ENABLE, 0)  # else the EEPROM is locked
                bus.write_unanswered(r.IDENTIFIER, identifier)
                clock.sleep_until(clock.now() + 0.1)
            else:
                bus.ping()
        finally:
            bus.close()
    return Observation(
        subject=f"servo {before}", verdict="good", found=f"has the ID {identifier}, and answers"
    )


def reboot_servos(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None]
) -> Observation:
    """Restart all servos on a port, which clears their alerts and switches their motors off.

    Raises:
        ServoSilent: None answers.
    """
    found = find_servos(port, clock, show)
    if found is None:
        raise ServoSilent(f"{port_name(port)}: a servo must answer to be restarted; none does")
    rate, models = found
    for identifier in models:
        bus = Bus(
            port,
            identifier=identifier,
            baud=rate,
            clock=clock,
            counters=ServoCounters(),
            retries=RETRIES,
        )
        bus.open()
        try:
            bus.reboot()
            clock.sleep_until(clock.now() + RESTART_PAUSE)
        finally:
            bus.close()
    listed = ", ".join(str(identifier) for identifier in models)
    return Observation(subject="servo", verdict="good", found=f"restarted: {listed}")
