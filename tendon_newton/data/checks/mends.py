"""Mends that no reader could do otherwise: rows that are no readings go, lost signs come back."""

from dataclasses import replace

import numpy as np

from tendon_newton.data.checks.lint_checks import unread_rows
from tendon_newton.data.checks.read_checks import repeated_rows, unread_angles
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.recording import Array, Mask, Recording

LEAST_KEPT = 0.5  # Share of the rows that a recording keeps [1]; with fewer it is not mended


def without_failed_reads(recording: Recording) -> Recording:
    """Return a recording without the rows in which some angle was not read."""
    bad = [unread_angles(recording, place) for place in range(recording.tendon_count)]
    return with_rows(recording, ~np.any(bad, axis=0))


def without_repeated_reads(recording: Recording) -> Recording:
    """Return a recording without the rows in which some angle was not read anew."""
    bad = [repeated_rows(theta) for theta in recording.motor_position.T]
    return with_rows(recording, ~np.any(bad, axis=0))


def with_rows(recording: Recording, kept: Mask) -> Recording:
    """Return some rows of a recording; all where too few would be left.

    Args:
        kept: Rows to keep, shape (T,).
    """
    if kept.all() or kept.mean() < LEAST_KEPT or kept.sum() < 2:
        return recording
    return replace(
        recording,
        time=recording.time[kept],
        enabled=recording.enabled[kept],
        extra={name: values[kept] for name, values in recording.extra.items()},
        **{name: values[kept] for name, values in channels_of(recording).items()},
    )


def channels_of(recording: Recording) -> dict[str, Array]:
    """Return what was commanded and measured by field, shape (T, ...) each."""
    return {name: getattr(recording, name) for name in recording.signals}


def with_signs(recording: Recording) -> Recording:
    """Return a recording whose registers have their negative values."""
    extra = {
        name: signed(values) if np.issubdtype(values.dtype, np.number) else values
        for name, values in recording.extra.items()
    }
    channels = channels_of(recording)
    channels = {name: np.apply_along_axis(signed, 0, channels[name]) for name in channels}
    return replace(recording, extra=extra, **channels)


def signed(values: Array) -> Array:
    """Return a column with the signs that it lost, if it lost any, shape (T,)."""
    lost = lost_sign(values) if np.isfinite(values).all() else None
    return values if lost is None else lost.mended(values)


def with_supply(recording: Recording) -> Recording:
    """Return a recording whose supply has the last good value where it was not read."""
    supply = recording.voltage
    return (
        recording
        if supply is None
        else replace(recording, voltage=held(supply, unread_rows(supply)))
    )


def held(values: Array, bad: Mask) -> Array:
    """Return values with the last good one in place of each bad one; the first good one before."""
    if not bad.any() or bad.all():
        return values
    good = np.flatnonzero(~bad)
    last = np.searchsorted(good, np.arange(values.size), side="right") - 1
    return values[good[np.maximum(last, 0)]]
