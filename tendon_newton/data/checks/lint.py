"""The table of checks of recorded data, before any model is fitted to them.

Every way in runs it: import, doctor and diagnose. A finding says what was seen, in which rows, and
what to do; where any reader would do the same, ``mend`` does it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.bench_checks import BenchFacts, against
from tendon_newton.data.checks.column_checks import ahead, degrees, short
from tendon_newton.data.checks.command_checks import (
    copied,
    exchanged_joints,
    no_command,
    turned_force,
)
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.frozen_checks import frozen_reads, slow_reads
from tendon_newton.data.checks.lint_checks import (
    clock,
    dead_channels,
    measured_channels,
    resting_position,
    supply_reads,
    torque_off,
    unsigned_current,
    velocity,
    wrapped,
)
from tendon_newton.data.checks.measures import rows_text
from tendon_newton.data.checks.mends import (
    with_signs,
    with_supply,
    without_failed_reads,
    without_repeated_reads,
)
from tendon_newton.data.checks.read_checks import failed_reads, repeated_reads
from tendon_newton.data.checks.seam_checks import position_jumps, without_seams, zeros
from tendon_newton.data.checks.set_checks import (
    contradictions,
    copies,
    off_zero,
    servos,
    still,
    warming,
)
from tendon_newton.data.recording import Array, Recording

__all__ = ["CHECKS", "BenchFacts", "Check", "Finding", "lint_dataset", "lint_recording", "mended"]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One thing that recorded data are looked at for."""

    name: str
    looks_at: str  # Columns, in words
    find: Callable[[Recording], Iterator[Finding]]
    # What any reader would do about it; None where that needs to be known from elsewhere
    mend: Callable[[Recording], Recording] | None = None


CHECKS: tuple[Check, ...] = (
    Check(name="lost sign", looks_at="any column", find=wrapped, mend=with_signs),
    Check(name="seam", looks_at="theta, theta_d", find=position_jumps, mend=without_seams),
    Check(name="failed read", looks_at="theta", find=failed_reads, mend=without_failed_reads),
    Check(name="failed supply", looks_at="voltage", find=supply_reads, mend=with_supply),
    Check(name="repeated read", looks_at="theta", find=repeated_reads, mend=without_repeated_reads),
    Check(name="frozen read", looks_at="theta, theta_d", find=frozen_reads),
    Check(name="slow read", looks_at="theta", find=slow_reads),
    Check(name="no command", looks_at="theta_d, theta", find=no_command),
    Check(name="turned force", looks_at="force, theta", find=turned_force),
    Check(name="zero", looks_at="theta, theta_d", find=zeros),
    Check(name="copied column", looks_at="theta_d, theta", find=copied),
    Check(name="exchanged joints", looks_at="theta_d, theta of several", find=exchanged_joints),
    Check(name="ahead", looks_at="theta, theta_d", find=ahead),
    Check(name="degrees", looks_at="theta, theta_d", find=degrees),
    Check(name="short", looks_at="t", find=short),
    Check(name="clock", looks_at="t", find=clock),
    Check(name="motor off", looks_at="enabled", find=torque_off),
    Check(name="speed", looks_at="theta_dot, theta", find=velocity),
    Check(name="dead channel", looks_at="any column", find=dead_channels),
    Check(name="rest", looks_at="theta, theta_d", find=resting_position),
    Check(name="current without sign", looks_at="current", find=unsigned_current),
)
"""Checks of one recording; mends are done in this order."""


def lint_recording(
    recording: Recording, limits: Mapping[str, float] | None = None, bench: BenchFacts | None = None
) -> tuple[Finding, ...]:
    """Run every check on one recording; what a mend would change misleads no later check.

    Args:
        limits: Known limits by column [column's unit], to find rows at the limit.
        bench: What is known of its bench, to find what the bench cannot do.
    """
    told: list[Finding] = []
    looked_at = recording
    for check in CHECKS:
        found = list(check.find(looked_at))
        told += [replace(one, check=check.name, safe=check.mend is not None) for one in found]
        if found and check.mend is not None:
            looked_at = with_every_row(looked_at, check.mend(looked_at))
    told += [*saturation(recording, limits or {})]
    if bench is not None:
        told += [replace(finding, check="bench") for finding in against(recording, bench)]
    return tuple(told)


def lint_dataset(train: Sequence[Recording], test: Sequence[Recording]) -> tuple[Finding, ...]:
    """Look for what only shows between recordings."""
    every = (*train, *test)
    between = (still, servos, contradictions, off_zero, warming)
    found = [(check.__name__, finding) for check in between for finding in check(every)]
    found += [("copies", finding) for finding in copies(train, test)]
    return tuple(replace(finding, check=name.replace("_", " ")) for name, finding in found)


def mended(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return a recording after every mend of the table that it needs, and what was mended."""
    told: list[Finding] = []
    derived = np.allclose(recording.motor_velocity, slope_of(recording))
    for check in CHECKS:
        found = () if check.mend is None else tuple(check.find(recording))
        if check.mend is not None and found:
            recording = check.mend(recording)
            told += [
                replace(
                    one, severity="note", check=check.name, consequence=f"mended: {one.consequence}"
                )
                for one in found
            ]
    if told and derived:
        recording = replace(recording, motor_velocity=slope_of(recording))
    return recording, tuple(told)


def with_every_row(recording: Recording, mend: Recording) -> Recording:
    """Return a mended recording with a straight line across the rows that its mend left out.

    A speed that was the slope of the angles stays it.
    """
    bridged = mend
    if mend.sample_count < recording.sample_count:
        angles = np.empty_like(recording.motor_position)
        for place, own in enumerate(mend.motor_position.T):
            angles[:, place] = np.interp(recording.time, mend.time, own)
        bridged = replace(recording, motor_position=angles)
    derived = np.allclose(recording.motor_velocity, slope_of(recording))
    return replace(bridged, motor_velocity=slope_of(bridged)) if derived else bridged


def slope_of(recording: Recording) -> Array:
    """Return the slope of the angles [rad/s], shape (T, D)."""
    return np.gradient(recording.motor_position, recording.time, axis=0)


def saturation(recording: Recording, limits: Mapping[str, float]) -> Iterator[Finding]:
    """Rows in which a channel sits at its known limit."""
    channels = dict(measured_channels(recording))
    for column, limit in limits.items():
        if column in channels and (reached := np.abs(channels[column]) >= limit).any():
            yield Examined(recording.name, column).note(
                f"{rows_text(reached, recording.time)} are at the limit of {limit:g}",
                "there the position loop does nothing; the model must limit too",
            )
