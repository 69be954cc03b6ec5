"""Columns that were taken for others: exchanged, in degrees, or too few rows of all."""

from collections.abc import Iterator

import numpy as np

from tendon_newton.data.checks.command_checks import LEAST_TIME, lead_of
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import lag_between, names_of, resolution
from tendon_newton.data.recording import SERVO, Array, Recording
from tendon_newton.data.stamps import unit_of_step

FASTEST_ROWS = 5e-4  # [s] between rows; servos of a bus are read more slowly
LEAST_LEAD = 0.005  # [s] stamps of a bus differ by less
LEAD_STEPS = 1.5  # [1] a command that holds for a row seems to come half a step late
LIKENESS = 0.9  # [1] below, two angles are too unlike for one to be the other's command
REACH = 0.1  # [s] of leads that are looked for; what seems to lead by more is another motion
LEAD_SHARE = 0.3  # [1] of what no lead leaves, which a lead must take away
LEAD_GAIN = 0.001  # [1] of the correlation: a lead that improves it by less is not resolved
ANGLE_TOO_FAR = 15.0  # [1] times as far as told no servo moves; a soft one in degrees goes beyond
COMMAND_TOO_FAR = 45.0  # [1] times as far as it moves; the strongest spring here leaves a third
SERVO_RATIOS = (1.5, 2.0)  # [1] likewise where no string or spring lets the servo go: no servo
# goes so much farther than told, and a slow one stays behind a fast command
COARSEST = 0.04  # [rad] no encoder has fewer than 150 counts a turn; 4096 of degrees are 0.088
FASTEST = 150.0  # [rad/s] three times the fastest of these servos
LEAST_VALUES = 30  # Values of a column from which their distance is its count
LEAST_RATIO = 8.0  # [1] times as far, from which on a gear is likelier than a soft servo
WIDE = 7.5  # [rad] a motion beyond is in degrees: the root of 57 turns one radian into as much
COUNTS = 400.0  # [1] from here on it is rather counts


def short(recording: Recording) -> Iterator[Finding]:
    """Less time than a servo takes for one answer."""
    if recording.duration < LEAST_TIME:
        step = float(np.median(np.diff(recording.time)))
        unit = f", unless t is in {unit_of_step(step)}" if step < FASTEST_ROWS else ""
        yield Examined(recording.name, "t").defect(
            f"lasts {recording.duration:.2g} s ({recording.sample_count} rows)",
            "too short to tell one cause from another: record 10 s or more with the "
            f"command in motion{unit}",
        )


def ahead(recording: Recording) -> Iterator[Finding]:
    """A shaft that moves before it is told to."""
    if recording.command is None:
        return
    time = recording.time
    step = float(np.median(np.diff(time)))
    for place, column in enumerate(names_of(recording, "theta")):
        theta, command = recording.motor_position[:, place], recording.command[:, place]
        lag, score, gain = lag_between(time, command, theta, time, REACH)
        sure = gain > LEAD_GAIN and gain > LEAD_SHARE * (1.0 - score + gain)
        reach = 0.9 * REACH
        if (far := lead_of(recording, place)) is not None:
            lag, score, sure, reach = -far.same_delay * step, far.same, True, np.inf
        if score > LIKENESS and max(LEAST_LEAD, LEAD_STEPS * step) < -lag < reach and sure:
            yield Examined(recording.name, column).defect(
                f"{-1e3 * lag:.0f} ms ahead of theta_d, {-lag / step:.1f} rows (correlation "
                f"{score:.3f})",
                "no servo moves before it is told to: theta and theta_d are exchanged (exchange "
                "them in the mapping), theta_d is some rows late, or their clocks differ",
            )


def degrees(recording: Recording) -> Iterator[Finding]:
    """Find angle and command of which one is in degrees, the other in radians."""
    if recording.command is None:
        yield from led_degrees(recording)
        return
    for place in range(recording.tendon_count):
        theta, command = recording.motor_position[:, place], recording.command[:, place]
        if (seen := coarse_or_fast(recording, theta)) is not None:
            yield Examined(recording.name, names_of(recording, "theta")[place]).defect(
                seen,
                'theta is in degrees: say unit = "deg" for it in the mapping, and for theta_d if '
                "that goes as far",
            )
            continue
        spread, asked = float(np.std(theta)), float(np.std(command))
        still = not np.ptp(theta) > 0.0 or not np.ptp(command) > 0.0
        if still or np.corrcoef(theta, command)[0, 1] < LIKENESS:
            continue
        own, its = SERVO_RATIOS if recording.bench == SERVO else (LEAST_RATIO, LEAST_RATIO)
        for column, other, size, ratio, low, least in (
            ("theta", "theta_d", theta, spread / asked, own, ANGLE_TOO_FAR),
            ("theta_d", "theta", command, asked / spread, its, COMMAND_TOO_FAR),
        ):
            channel = Examined(recording.name, names_of(recording, column)[place])
            if least < ratio < COUNTS:
                yield channel.defect(
                    f"moves {ratio:.1f} times as far as {other}, by {np.ptp(size):.3g} rad",
                    f'{column} is in degrees: say unit = "deg" for it in the mapping'
                    if np.ptp(size) > WIDE
                    else f'{other} was in rad and taken for degrees: say unit = "rad" for it in '
                    "the mapping",
                )
            elif low < ratio <= least:
                yield channel.caution(
                    f"moves {ratio:.1f} times as far as {other}, and with it",
                    f"{column} or {other} has another unit or the other side of a gear (scale in "
                    "the mapping); a spring that lets a servo go so little is rare",
                )


def led_degrees(recording: Recording) -> Iterator[Finding]:
    """Find angles that are in degrees where no command stands beside them."""
    for place, column in enumerate(names_of(recording, "theta")):
        theta = recording.motor_position[:, place]
        spans, mend = float(np.ptp(theta)), 'say unit = "deg" for it in the mapping'
        if (seen := coarse_or_fast(recording, theta)) is not None:
            yield Examined(recording.name, column).defect(seen, f"{column} is in degrees: {mend}")
        elif spans > WIDE:
            yield Examined(recording.name, column).caution(
                f"spans {spans:.3g} rad, {spans / (2.0 * np.pi):.2g} turns",
                f"no joint of an arm turns as far: if {column} is in degrees, {mend}",
            )


def coarse_or_fast(recording: Recording, theta: Array) -> str | None:
    """Say that an angle has coarser counts than any encoder, or goes faster than any servo."""
    pulled = recording.command is not None and recording.force is not None
    if float(np.ptp(theta)) < WIDE or pulled:
        return None  # a string that goes slack lets a spool spin
    count, speed = resolution(theta), float(np.quantile(np.abs(slope(recording, theta)), 0.95))
    if count > COARSEST and np.unique(theta).size >= LEAST_VALUES:
        how = f"changes in steps of {count:.3g} rad, coarser than any encoder"
    elif speed > FASTEST:
        how = f"moves at {speed:.3g} rad/s, faster than any servo"
    else:
        return None
    return f"{how}, by {np.ptp(theta):.3g} rad"


def slope(recording: Recording, theta: Array) -> Array:
    """Return the slope of an angle [rad/s], shape (T,)."""
    return np.gradient(theta, recording.time)
