"""Steps of setting a servo up: greet it, set and verify its registers, arm it, switch it off."""

from contextlib import suppress

from tendon_hardware import errors
from tendon_hardware.clock import Clock
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import ServoSpec, alert_words
from tendon_hardware.servos.bus import Bus
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.family import WATCHDOG_PERIOD, Targets
from tendon_hardware.servos.serial_bus.packets import Register

GREETINGS = 3  # Pings before another model is believed
LATE_ANSWER = 0.05  # Wait for an answer that nobody asked for [s]
SECOND_ANSWER = 0.005
"""Wait for the answer of another servo to the same ping [s]; an adapter adds 1 ms."""
RESTART_TIME = 2.0  # Longest restart of a servo [s]; it takes some tenths
POLL_PERIOD = 0.05  # Pause between pings while it restarts [s]
STILL_DUTY, STILL_CURRENT = 0.02, 0.05
"""Shares of duty, and of the current at standstill, that a motor without a bridge may tell [1]."""
FALL_TIME = 0.1  # Time in which they fall [s]; a slope takes a quarter of it
TORQUE_OFF_ATTEMPTS = 5  # Rounds of writing and reading back, each with the retries of the bus


def greet(bus: Bus, spec: ServoSpec, clock: Clock) -> None:
    """Make sure that the expected servo answers, alone, and answers everything from now on."""
    model = 0
    for _ in range(GREETINGS):  # the answer to an earlier read may look like one to a ping
        model = bus.ping()
        if model == spec.model_number:
            break
    if model != spec.model_number:
        names = {each.model_number: each.name for each in SERVOS.values()}
        raise errors.UnsupportedServo(
            f"servo {bus.identifier} must be {spec.name} (model {spec.model_number}); "
            f"it is model {model}, {names.get(model, 'unknown')}"
        )
    refuse_second(bus, clock)
    try:
        (level,) = bus.read(bus.table.answers)
    except errors.ServoSilent:
        level = 0  # it answers to a ping alone
    if level != bus.table.answers_all:
        bus.write_unanswered(bus.table.answers, bus.table.answers_all)
        clock.sleep_until(clock.now() + LATE_ANSWER)


def refuse_second(bus: Bus, clock: Clock) -> None:
    """Refuse a bus on which each ping is answered twice: another servo has the same ID.

    Raises:
        SharedIdentifier: Two servos answer.
    """
    for _ in range(GREETINGS):
        clock.sleep_until(clock.now() + SECOND_ANSWER)
        bus.ping()
    bus.refuse_second(GREETINGS - 1)


def await_restart(bus: Bus, spec: ServoSpec, clock: Clock) -> None:
    """Wait until a servo that was restarted answers again."""
    deadline = clock.now() + RESTART_TIME
    while True:
        clock.sleep_until(clock.now() + POLL_PERIOD)
        try:
            greet(bus, spec, clock)
            return
        except errors.ServoSilent:
            if clock.now() > deadline:
                raise


def apply(bus: Bus, targets: Targets) -> None:
    """Set a servo whose motor is off, and verify it."""
    if bus.table.watchdog is not None:
        set_verified(bus, bus.table.watchdog, 0)
    for register, counts in targets:
        if bus.read(register) != (counts,):  # EEPROM wears out with every write
            bus.write(register, counts)
    verify(bus, targets)


def verify(bus: Bus, targets: Targets) -> None:
    """Read everything back that was set.

    Raises:
        SettingMismatch: A register differs.
    """
    for register, counts in targets:
        (found,) = bus.read(register)
        if found != counts:
            raise errors.SettingMismatch(
                f"servo {bus.identifier}: {register.name} ({register.address}) must be {counts} "
                f"before the motor runs; it reads {found}"
            )


def set_verified(bus: Bus, register: Register, counts: int) -> None:
    """Write a register and read it back."""
    bus.write(register, counts)
    verify(bus, ((register, counts),))


def refuse_alert(bus: Bus, spec: ServoSpec) -> None:
    """Refuse to go on with a servo that reports a hardware error."""
    (error,) = bus.read(bus.table.alerts)
    if error:
        raise errors.ServoAlert(alert_text(bus, spec, error))


def alert_text(bus: Bus, spec: ServoSpec, error: int) -> str:
    """Say what a hardware error is and what ends it."""
    family = FAMILIES[spec.family]
    words = ", ".join(alert_words(error, family.alerts))
    return (
        f"servo {bus.identifier} reports {words} (register {bus.table.alerts.address} is "
        f"{error}); remove the cause, then {family.remedy}"
    )


def arm_watchdog(bus: Bus, watchdog: float) -> None:
    """Let the servo stop by itself after a silence [s]; armed from a clear state only.

    A servo without a watchdog goes on: there is nothing to arm.
    """
    register = bus.table.watchdog
    if register is not None:
        set_verified(bus, register, 0)
        set_verified(bus, register, round(watchdog / WATCHDOG_PERIOD))


def switch_off(bus: Bus) -> None:
    """Switch the motor off, under an alert as well, and until it reads back as off.

    Raises:
        ServoSilent: The register never read as off.
        PortLost: The adapter is gone.
    """
    for _ in range(TORQUE_OFF_ATTEMPTS):
        # the answer may be lost where the motor is off; the register tells
        with suppress(errors.ServoSilent, errors.ServoRefused):
            bus.write(bus.table.torque, 0)
        try:
            (torque,) = bus.read(bus.table.torque)
        except errors.ServoSilent:
            continue
        if not torque:
            return
    raise errors.ServoSilent(
        f"servo {bus.identifier} must answer that its motor is off; after "
        f"{TORQUE_OFF_ATTEMPTS} attempts it has not: switch its supply off"
    )


def refuse_driven(bus: Bus, spec: ServoSpec, clock: Clock) -> None:
    """Make sure that a motor that reads as off has neither duty nor current.

    A servo that does not answer is not judged: its register has said that the motor is off.

    Raises:
        MotorStillDriven: It has.
    """
    deadline = clock.now() + FALL_TIME
    while True:
        try:
            duty, current = bus.read(bus.table.duty, bus.table.current)
        except errors.ServoSilent:
            return
        share = duty / spec.duty_counts
        taken = current * spec.current_unit
        if abs(share) <= STILL_DUTY and abs(taken) <= STILL_CURRENT * spec.stall_current:
            return
        if clock.now() > deadline:
            break
        clock.sleep_until(clock.now() + SECOND_ANSWER)
    raise errors.MotorStillDriven(
        f"servo {bus.identifier} must neither drive its motor nor take a current once it is "
        f"switched off; it tells a duty of {share:.2f} and {taken:.2f} A: switch its supply off"
    )
