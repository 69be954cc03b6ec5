"""What only shows between recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.checks.command_checks import idle
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.lint_checks import CORRELATION_LIMIT
from tendon_newton.data.checks.measures import correlations
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import listed

SLOW = 0.3  # [rad/s] a motion whose friction and inertia matter less than the servo's pull
PUSHING = 0.9  # [1] of the rows below zero: a string that pushes is told of by its bench
LEAST_PULLS = 2  # Recordings that must agree
LEAST_SLOW = 50  # Rows from which a slope is one
FAR_GAIN = 10.0  # [1] times what the force grows by; a degree is 57, a spool's radius 80 times off
OFF_ZERO = 0.28  # [rad] more than a tooth of a 25-tooth spline; what less is, a diagnosis names
AGREED = 0.1  # [1] of such a zero, within which recordings must agree on it
WARMING_LIMIT = 3.0  # [K] one degree is the resolution; copper changes by 1.2 % in 3 K
CONTRADICTION = 0.1  # [1] of the motion; wear and stiction of a sound finger stay below
LEAST_CONTRADICTION = 0.02  # [rad] as little is backlash


def still(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Recordings whose command or angle never changes: wrong where no recording has one that does.

    One joint of several rests in many a motion.
    """
    found = [list(idle(recording)) for recording in recordings]
    rests = [any("nothing moves" in one.consequence for one in own) for own in found]
    for own, rest in zip(found, rests, strict=True):
        for finding in own:
            if rest and not all(rests):
                finding = replace(finding, severity="note", consequence="tells of a rest alone")
            yield finding


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


def servos(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Kinds of servo among recordings that one model is to explain."""
    kinds = servo_kinds(recordings)
    if len(kinds) > 1:
        yield Examined("all", "servo").defect(
            f"the recordings are of {listed(kinds)}",
            "a model is of one servo: make a dataset for each",
        )


def servo_kinds(recordings: Sequence[Recording]) -> list[str]:
    """Return the kinds of servo that recordings say they are of."""
    return sorted({recording.servo for recording in recordings if recording.servo})


def copies(train: Sequence[Recording], test: Sequence[Recording]) -> Iterator[Finding]:
    """Test recordings that are train recordings under another name."""
    for held in test:
        for seen in train:
            if np.array_equal(held.motor_position, seen.motor_position):
                yield Examined(held.name, "theta").defect(
                    f"equal to {seen.name} of the train split in every row",
                    "errors on it are not held out",
                )


def warming(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Temperature that goes with a setting, so that the two cannot be told apart."""
    warm = [recording for recording in recordings if recording.temperature is not None]
    keys = sorted({key for recording in warm for key in recording.actuator_overrides})
    for key in keys:
        groups: dict[float, list[float]] = {}
        for recording in warm:
            if key in recording.actuator_overrides and recording.temperature is not None:
                value = recording.actuator_overrides[key]
                groups.setdefault(value, []).append(float(recording.temperature.mean()))
        means = {value: float(np.mean(groups[value])) for value in sorted(groups)}
        rise = max(means.values()) - min(means.values())
        (trend,) = correlations(np.array(list(means)), np.array(list(means.values())))
        if rise > WARMING_LIMIT and abs(trend) > CORRELATION_LIMIT:
            listed = ", ".join(f"{mean:.1f} degC at {value:.3g}" for value, mean in means.items())
            yield Examined("all", "temperature").caution(
                f"goes with {key}: {listed}",
                f"an effect of temperature cannot be told from one of {key}",
            )


def off_zero(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """A force that falls as the servo is asked for more, or is none where it is asked for much."""
    found = [pull for recording in recordings if (pull := pull_of(recording)) is not None]
    if len(found) < LEAST_PULLS:
        return
    sure, zeros, _ = np.array(found).T
    zero = float(np.median(zeros))
    spread = float(np.median(np.abs(zeros - zero)))
    if np.median(sure) < 0.0:
        yield Examined("all", "force").defect(
            f"falls as theta_d - theta grows, in {len(found)} recordings",
            "a servo pulls towards its goal: force, or both theta and theta_d, count the other way "
            "(sign = -1 in the mapping)",
        )
    elif abs(zero) > OFF_ZERO and spread < AGREED * abs(zero):
        yield Examined("all", "theta").caution(
            f"the force is zero where theta_d - theta is {zero:+.2f} rad, to {spread:.2f} rad in "
            f"{len(found)} recordings",
            f"the zeros of theta and theta_d differ: say offset = {zero:+.3f} for theta in the "
            "mapping, unless the force's own zero is off",
        )


def other_gain(
    recordings: Sequence[Recording], gain: float, numbers: Sequence[str]
) -> Iterator[Finding]:
    """A stated gain [N/rad] that is far from what the force grows by.

    Args:
        numbers: Names of what is stated, each with its unit.
    """
    found = [pull for recording in recordings if (pull := pull_of(recording)) is not None]
    slopes = [slope for sure, _, slope in found if sure > 0.0]
    if slopes and not 1.0 / FAR_GAIN < gain / np.median(slopes) < FAR_GAIN:
        yield Examined("all", "force").defect(
            f"grows by {np.median(slopes):.3g} N per rad of theta_d - theta, and by "
            f"{listed(numbers)} of the model by {gain:.3g}",
            "gain is in N/rad at the spool: one of N/deg is times 57.3, a torque's of N m/rad is "
            "divided by spool_radius"
            if len(numbers) == 1
            else "one of these is in another unit, or a register's count",
        )


def pull_of(recording: Recording) -> tuple[float, float, float] | None:
    """Return how surely a servo pulls towards its goal, and what it is off where it pulls nothing.

    Returns:
        Correlation of force and distance to the goal in slow rows [1], the distance at which the
        force vanishes [rad], and force per distance [N/rad]; None where these rows do not tell.
    """
    if recording.force is None or recording.command is None or recording.tendon_count > 1:
        return None
    theta, time = recording.motor_position[:, 0], recording.time
    slope: Array = np.gradient(theta, time)
    slow = np.abs(slope) < SLOW
    if slow.sum() < LEAST_SLOW:
        return None
    asked, force = (recording.command[:, 0] - theta)[slow], recording.force[slow, 0]
    spread = float(np.std(asked) * np.std(force))
    goes = float((asked - asked.mean()) @ (force - force.mean())) / asked.size
    if not abs(goes) > CORRELATION_LIMIT * spread or np.mean(force < 0.0) > PUSHING:
        return None
    gain = goes / float(np.var(asked))
    return goes / spread, float(asked.mean() - force.mean() / gain), gain
