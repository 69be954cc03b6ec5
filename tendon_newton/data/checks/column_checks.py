"""Columns that were taken for others: exchanged, in degrees, or too few rows of all."""

from collections.abc import Iterator, Sequence

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.register_checks import lag_between
from tendon_newton.data.recording import Recording

LEAST_TIME = 1.0  # [s] the slowest servo here answers a step in half of it
LEAST_LEAD = 0.005  # [s] stamps of a bus differ by less
LEAD_STEPS = 1.5  # [1] a command that holds for a row seems to come half a step late
LIKENESS = 0.9  # [1] below, two angles are too unlike for one to be the other's command
LEAD_GAIN = 0.001  # [1] of the correlation: a lead that improves it by less is not resolved
ANGLE_TOO_FAR = 15.0  # [1] times as far as told no servo moves; a soft one in degrees goes beyond
COMMAND_TOO_FAR = 45.0  # [1] times as far as it moves; the strongest spring here leaves a third
COUNTS = 400.0  # [1] from here on it is rather counts
CONTRADICTION = 0.1  # [1] of the motion; wear and stiction of a sound finger stay below
LEAST_CONTRADICTION = 0.02  # [rad] as little is backlash


def short(recording: Recording) -> Iterator[Finding]:
    """Less time than a servo takes for one answer."""
    if recording.duration < LEAST_TIME:
        yield Examined(recording.name, "t").defect(
            f"lasts {recording.duration:.2g} s ({recording.sample_count} rows)",
            "too short to tell one cause from another: record 10 s or more with the "
            "command in motion",
        )


def exchanged(recording: Recording) -> Iterator[Finding]:
    """A shaft that moves before it is told to."""
    if recording.command is None:
        return
    time = recording.time
    least = max(LEAST_LEAD, LEAD_STEPS * float(np.median(np.diff(time))))
    for place in range(recording.tendon_count):
        theta, command = recording.motor_position[:, place], recording.command[:, place]
        lag, score, gain = lag_between(time, command, theta, time)
        if score > LIKENESS and lag < -least and gain > LEAD_GAIN:
            yield Examined(recording.name, "theta").defect(
                f"{-1e3 * lag:.0f} ms ahead of theta_d (correlation {score:.3f})",
                "no servo moves before it is told to: theta and theta_d are exchanged "
                "(exchange them in the mapping), or their clocks differ",
            )


def degrees(recording: Recording) -> Iterator[Finding]:
    """Find angle and command of which one is in degrees, the other in radians."""
    if recording.command is None:
        return
    for place in range(recording.tendon_count):
        theta, command = recording.motor_position[:, place], recording.command[:, place]
        spread, asked = float(np.std(theta)), float(np.std(command))
        if not spread > 0.0 or not asked > 0.0 or np.corrcoef(theta, command)[0, 1] < LIKENESS:
            continue
        for column, other, ratio, least in (
            ("theta", "theta_d", spread / asked, ANGLE_TOO_FAR),
            ("theta_d", "theta", asked / spread, COMMAND_TOO_FAR),
        ):
            if least < ratio < COUNTS:
                yield Examined(recording.name, column).defect(
                    f"moves {ratio:.1f} times as far as {other}",
                    f'{column} is in degrees: say unit = "deg" in the mapping',
                )


def contradictions(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Runs of one command on one bench whose angles differ, told once."""
    pairs: list[tuple[float, Recording, Recording]] = []
    groups: dict[object, list[Recording]] = {}
    for r in recordings:
        if r.command is not None and r.obstacle == "free":
            key = (r.bench, r.bench_overrides, tuple(r.actuator_overrides.items()))
            groups.setdefault((*key, r.command.shape, r.command.tobytes()), []).append(r)
    for first, *others in groups.values():
        motion = float(np.ptp(first.motor_position))
        for other in others:
            apart = float(np.sqrt(np.mean((other.motor_position - first.motor_position) ** 2)))
            if apart > max(CONTRADICTION * motion, LEAST_CONTRADICTION):
                pairs.append((apart, first, other))
    if pairs:
        apart, first, other = max(pairs, key=lambda pair: pair[0])
        yield Examined("all", "theta").caution(
            f"{len(pairs)} runs repeat a command and answer it otherwise; farthest apart "
            f"are {first.name} and {other.name}, by {1e3 * apart:.0f} mrad RMS",
            "no model answers one command in two ways: something changed between them "
            "that no column says; state it (actuator_overrides, bench_overrides) or leave one out",
        )


COLUMN_CHECKS = (short, exchanged, degrees)
