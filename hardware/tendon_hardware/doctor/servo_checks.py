"""The servo: found at some rate, known, healthy, and quick enough."""

from collections.abc import Callable, Iterator

import numpy as np

from tendon_hardware.clock import Clock
from tendon_hardware.doctor.observation import Observation, Verdict, observed
from tendon_hardware.doctor.servo_search import RETRIES, find_servos, sought
from tendon_hardware.errors import HardwareFault, ServoSilent
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.base import ServoHealth, ServoSettings, ServoSpec
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.servos.serial_bus.servo_port import PortHandler

RATE_MIN = 1_000_000
"""Slowest rate at which a read leaves time for a loop at 80 Hz [1/s]: it takes 0.35 ms on the bus,
and 6.1 ms at the factory's 57,600."""
READS = 200  # States that are read to time them
FAILURE_MAX = 0.01  # Share of instructions that may fail once [1]
WARM = 55.0  # Temperature from which a long recording will end early [degC]


def check_servo(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None], *, busy: bool = False
) -> Iterator[Observation]:
    """Find the servos on a port and examine each; no motor moves.

    Args:
        busy: Whether this computer has been found busy, so that nobody blames the bus.
    """
    found = find_servos(port, clock, show)
    if found is None:
        listed = ", ".join(str(rate) for rate in dict.fromkeys(rate for _, rate in sought()))
        yield observed(
            "fix",
            "servo",
            f"none answers at {listed} baud",
            "see that the power board's supply is on, the servo's lamp blinks when it is "
            "switched on, the three-pin plug sits at both ends, and the ports are not exchanged",
        )
        return
    rate = found.rate
    names = {s.model_number: s for s in SERVOS.values() if s.family == found.family}
    for identifier, model in found.models.items():
        subject = f"servo {identifier}"
        if model not in names:
            known = ", ".join(f"{spec.name} ({number})" for number, spec in names.items())
            yield observed(
                "fix",
                subject,
                f"model {model} is not among {known}",
                "describe it in hardware/tendon_hardware/servos, from its control table",
            )
            continue
        yield check_rate(subject, names[model], rate)
        servo = BusServo(
            names[model], port, identifier=identifier, baud=rate, clock=clock, retries=RETRIES
        )
        try:
            servo.open()
            yield from check_one(subject, servo, clock, show, busy=busy)
        except HardwareFault as fault:
            yield observed("fix", subject, str(fault), "look at plugs and cable, and start again")
        finally:
            servo.close()


def check_rate(subject: str, spec: ServoSpec, rate: int) -> Observation:
    """Judge the rate of the bus."""
    slow = rate < RATE_MIN
    return observed(
        "fix" if slow else "good",
        subject,
        f"{spec.name} at {rate} baud{', too slow for 80 Hz' if slow else ''}",
        f"tendon-newton doctor --port ... --set-baud {RATE_MIN}",
    )


def check_one(
    subject: str, servo: BusServo, clock: Clock, show: Callable[[str], None], *, busy: bool = False
) -> Iterator[Observation]:
    """Examine an open servo."""
    settings = servo.settings()
    delay = settings.return_delay
    yield observed(
        "note" if delay > 0.0 else "good",
        f"{subject} settings",
        f"firmware {settings.firmware}, mode {settings.operating_mode}, gains "
        f"{settings.gains.proportional}/{settings.gains.integral}/{settings.gains.derivative}, "
        f"current limit {settings.current_limit:g} A, answers after {1e6 * delay:.0f} us",
        "nothing: our programs set what they need and log it",
    )
    yield from check_firmware(subject, servo, settings)
    yield from check_health(subject, servo.spec, servo.read_health())
    show(f"timing {READS} reads")
    yield check_speed(subject, servo, clock, busy=busy)


def check_firmware(subject: str, servo: BusServo, settings: ServoSettings) -> Iterator[Observation]:
    """Say what a servo's firmware does by itself, or does not do."""
    if servo.table.watchdog is None:
        yield observed(
            "note",
            f"{subject} watchdog",
            "it has none: it drives on when its cable or this computer fails",
            "keep the switch of its supply within reach whenever its motor is on",
        )
    overload, dead_zone = settings.overload, settings.dead_zone
    if overload is not None and dead_zone is not None:
        yield observed(
            "note",
            f"{subject} firmware",
            f"{overload.protective_duty:.0%} duty after {overload.time:g} s at "
            f"{overload.duty:.0%} or more; its own position loop leaves errors of "
            f"{1e3 * max(dead_zone):.1f} mrad",
            "nothing: recordings name these numbers; a model may need overload_cut",
        )


def check_health(subject: str, spec: ServoSpec, health: ServoHealth) -> Iterator[Observation]:
    """Judge supply, temperature, alerts, watchdog and torque."""
    low, high = spec.supply_range
    good = low <= health.voltage <= high
    yield observed(
        "good" if good else "fix",
        f"{subject} supply",
        f"{health.voltage:.1f} V",
        f"give it {spec.supply_voltage:g} V ({low:g} to {high:g} V)",
    )
    warm = health.temperature >= WARM
    yield observed(
        "note" if warm else "good",
        f"{subject} temperature",
        f"{health.temperature:.0f} degC; it shuts down at {spec.temperature_limit:.0f}",
        "let it cool before a long recording",
    )
    yield observed(
        "fix" if health.alerts else "good",
        f"{subject} alerts",
        ", ".join(health.alerts) or "none",
        f"remove the cause, then {FAMILIES[spec.family].remedy}",
    )
    if health.watchdog_tripped:
        yield observed(
            "note",
            f"{subject} watchdog",
            "tripped: the last program ended without switching the motor off",
            "nothing: our programs clear it before they start",
        )
    if health.torque_enabled:
        yield observed(
            "note",
            f"{subject} motor",
            "on, though no program of ours holds it",
            "keep clear of the finger; our programs switch it off before they start",
        )


def check_speed(subject: str, servo: BusServo, clock: Clock, *, busy: bool = False) -> Observation:
    """Time reads of the state and judge whether a loop at 80 Hz has room for a read and a write.

    A busy computer makes answers late, which then says nothing of the bus.
    """
    counters = servo.counters
    silent, corrupted = counters.silent, counters.corrupted
    times: list[float] = []
    missed = 0
    for _ in range(READS):
        start = clock.now()
        try:
            servo.read_state()
        except ServoSilent:
            missed += 1
            continue
        times.append(clock.now() - start)
    silent, corrupted = counters.silent - silent, counters.corrupted - corrupted
    failed = silent + corrupted
    subject = f"{subject} speed"
    late: Verdict = "note" if busy else "fix"
    blamed = "this computer is busy (see clock): examine again when it is not" if busy else ""
    if missed or not times or failed > FAILURE_MAX * READS:
        return observed(
            "fix" if corrupted else late,
            subject,
            f"of {READS} reads {missed} never came and {failed} answers were lost or broken",
            "look at plugs, cable and ground; keep the cable away from the motor's supply"
            if corrupted
            else blamed
            or "answers come late or never: see the latency timer, then look at plugs and cable",
        )
    median, slow = (1e3 * float(q) for q in np.quantile(times, (0.5, 0.99)))
    fits = 2.0 * slow < 12.5  # a read and a write per tick of 12.5 ms
    return observed(
        "good" if fits else late,
        subject,
        f"a read takes {median:.2f} ms, one in a hundred {slow:.2f} ms: "
        f"{1e3 / median:.0f} Hz; a loop at 80 Hz {'fits' if fits else 'does not fit'}",
        blamed or "set the latency timer to 1 ms",
    )
