"""Rows of a servo's log in which a register was not read, though a row was written."""

from collections.abc import Mapping
from math import pi

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.recording import Array, Mask

COUNT = 2.0 * pi / 4096.0  # [rad] of these servos' encoders
ZERO_REACH = 1.5 * COUNT  # a position register of 0 is -pi in these logs, within their rounding
JUMP_LIMIT = 0.5  # [rad] no servo of this table turns so far within a row
SUPPLY_RANGE = (0.5, 1.5)  # [1] of the median: a sag is less, a failed read says 0 or 25 V


def without_failed_reads(
    columns: Mapping[str, Array], name: str
) -> tuple[dict[str, Array], list[Finding]]:
    """Leave out rows whose position was not read, and mend the supply where only that was not.

    A position register that was not read says 0, which is half a turn from where the arm hangs: a
    lone row that the neighbours on both sides do not lead to. A supply that was not read takes the
    last good value, since a supply of 0 V would stop a simulated motor.

    Args:
        columns: The log's columns, shape (T,) each.
        name: The recording, for the findings.
    """
    left_out = unread_positions(columns["position"])
    findings = [failed(name, "theta", left_out, "left out: uneven sampling is allowed")]
    kept = {key: values[~left_out] for key, values in columns.items()}
    if "input_volts" in kept:
        bad = unread_supply(kept["input_volts"])
        kept["input_volts"] = held(kept["input_volts"], bad)
        findings.append(failed(name, "voltage", bad, "the last good value stands in their place"))
        if "temp" in kept:  # both come in one transaction
            lost = bad & (kept["temp"] <= 0.0)
            kept["temp"] = held(kept["temp"], lost)
    return kept, [finding for finding in findings if finding is not None]


def unread_positions(position: Array) -> Mask:
    """Tell which rows hold a register of 0 that the motion does not lead to, shape (T,)."""
    zero = np.abs(position + pi) < ZERO_REACH
    rows = np.arange(position.size)
    if not zero.any() or zero.all():
        return np.zeros(position.size, dtype=bool)
    good = rows[~zero]
    expected = np.interp(rows, good, position[good])
    return zero & (np.abs(position - expected) > JUMP_LIMIT)


def unread_supply(voltage: Array) -> Mask:
    """Tell which rows hold a supply far from all others, shape (T,)."""
    median = float(np.median(voltage))
    if median <= 0.0:
        return np.zeros(voltage.size, dtype=bool)
    return (voltage < SUPPLY_RANGE[0] * median) | (voltage > SUPPLY_RANGE[1] * median)


def held(values: Array, bad: Mask) -> Array:
    """Return values with the last good one in place of each bad one; the first good one before."""
    if not bad.any() or bad.all():
        return values
    good = np.flatnonzero(~bad)
    last = np.searchsorted(good, np.arange(values.size), side="right") - 1
    return values[good[np.maximum(last, 0)]]


def failed(name: str, channel: str, rows: Mask, done: str) -> Finding | None:
    """Say how many rows were not read, and what was done with them."""
    if not rows.any():
        return None
    return Examined(name, channel).caution(
        f"{rows.sum()} of {rows.size} rows, first row {int(rows.argmax())}",
        f"the register was not read there; {done}",
    )
