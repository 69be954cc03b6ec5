"""Checks of one recording, each looking at one thing and changing nothing."""

from collections.abc import Iterator

import numpy as np

from tendon_newton.data.checks.command_checks import LIKE, follows
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import lag_between, names_of, rows_text, scatters
from tendon_newton.data.formats.csv_file import TENDON_COLUMNS, named_by_tendon
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.recording import Array, Mask, Recording

RATE_SPREAD_LIMIT = 1.2  # [1] step lengths that differ by less are jitter of a healthy bus
SLOW_ROWS = 0.09  # [s] a row; the slowest dataset of LeRobot has 10 a second
GAP_LIMIT = 3.0  # [1] steps longer than this many median steps are gaps
LAG_LIMIT = 0.005  # [s] shorter lags matter to no bench here
LAG_STEPS_LIMIT = 0.75  # [1] of the median step: impacts between rows look like half a step of lag
CORRELATION_LIMIT = 0.9  # [1] below, motion is too small against resolution to compare channels
LAG_GAIN_LIMIT = 0.001  # [1] a lag that improves the correlation by less is not resolved
SCALE_RANGE = (0.3, 3.0)  # [1] theta_dot over slope of theta; impacts and slack stay inside, while
# rev/min (9.5), degrees (57) and counts of 0.229 rev/min (42) do not
WAY_TIME, WAYS, WAY = 0.25, 20, 0.05  # [s], number and spread [rad] of ways that tell a speed
NO_SPEED = 0.2  # [1] correlation below which a column is none; late and slow ones stay above
GEAR_RATIOS = (100.0, 1000.0)  # [1] of hobby servos
UNIT_NEAR = 2.0 * np.pi / 4096.0  # [1] counts of an encoder taken for radians
UNIT_SPARE = 0.05  # [1] within which a scale is such a unit
SUPPLY_RANGE = (0.5, 1.5)  # [1] of the median; no sag and no surge goes beyond
CLIPPED = 0.02  # Share of the rows with the greatest force [1]; a peak of a sine has less
CLIPPED_WAY = 0.2  # [1] of a shaft's way, over which no string pulls alike to the last digit
MOTION_LIMIT = 0.1  # [rad] less motion of the shaft counts as standing still
STUCK_LIMIT = 0.5  # [s] shorter rests are turning points
BLOCKED_ERROR = 0.1  # [rad] no lag of a moving position servo reaches it
BLOCKED_REST = 0.025  # [rad] from the end of its way: what stops a gear gives way
BLOCKED_ROWS = 20  # fewer are a turning point
SIGN_SHARE = 0.05  # [1] rows either way that make a reversal more than a settling


def clock(recording: Recording) -> Iterator[Finding]:
    """Uneven sampling and gaps."""
    steps = np.diff(recording.time)
    short, middle, long = np.percentile(steps, [1.0, 50.0, 99.0])
    (gaps,) = np.nonzero(steps > GAP_LIMIT * middle)
    if middle > SLOW_ROWS:
        yield Examined(recording.name, "t").caution(
            f"the rows are {1e3 * middle:.0f} ms apart",
            "delays and lags below that are not told: log 20 rows a second or more",
        )
    if gaps.size:
        worst = int(gaps[np.argmax(steps[gaps])])
        yield Examined(recording.name, "t").caution(
            f"{gaps.size} gaps; the largest lasts {1e3 * steps[worst]:.0f} ms after "
            f"t = {recording.time[worst]:.3f} s (median step {1e3 * middle:.1f} ms)",
            "commands sent within a gap are unknown; differences across it mean little",
        )
    elif long > RATE_SPREAD_LIMIT * short:
        yield Examined(recording.name, "t").note(
            f"mean rate {1.0 / steps.mean():.0f} Hz, steps from {1e3 * short:.2f} to "
            f"{1e3 * long:.2f} ms ({1.0 / long:.0f}-{1.0 / short:.0f} Hz), none longer than "
            f"{1e3 * steps.max():.2f} ms",
            "use t row by row; nothing may assume one rate",
        )


def velocity(recording: Recording) -> Iterator[Finding]:
    """A velocity channel that lags the position or has another scale."""
    time = recording.time
    middle = 0.5 * (time[1:] + time[:-1])  # a difference quotient belongs between its rows
    for place, column in enumerate(names_of(recording, "theta_dot")):
        slope = np.diff(recording.motor_position[:, place]) / np.diff(time)
        register = recording.motor_velocity[:, place]
        if (found := no_speed(time, recording.motor_position[:, place], register)) is not None:
            yield Examined(recording.name, column).defect(*found)
            continue
        lag, score, gain = lag_between(middle, slope, register, time)
        if score < CORRELATION_LIMIT:
            continue
        reference = np.interp(time - lag, middle, slope)
        scale = float(register @ reference / (reference @ reference))
        if not SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
            yield Examined(recording.name, column).defect(
                f"{scale:.4g} times the slope of theta (correlation {score:.3f})",
                misread_speed(scale),
            )
        limit = max(LAG_LIMIT, LAG_STEPS_LIMIT * float(np.median(np.diff(time))))
        if abs(lag) >= limit and gain > LAG_GAIN_LIMIT:
            yield Examined(recording.name, column).caution(
                f"{abs(lag) * 1e3:.0f} ms {'behind' if lag > 0.0 else 'ahead of'} the "
                f"slope of theta (correlation {score:.3f})",
                "do not use theta_dot as the speed at its row; a start from the first "
                "row takes an old speed; residuals of theta_dot show the lag",
            )


def no_speed(time: Array, theta: Array, speed: Array) -> tuple[str, str] | None:
    """Say that a speed turns a shaft the other way, or is none, by the ways of some rows."""
    rows = max(1, round(WAY_TIME / float(np.median(np.diff(time)))))
    driven = np.r_[0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))]
    ways, told = (np.diff(column[::rows]) for column in (theta, driven))
    if ways.size < WAYS or np.std(ways) < WAY or np.std(told) == 0.0:
        return None
    alike = float(np.corrcoef(ways, told)[0, 1])
    seen = f"goes with the slope of theta by a correlation of {alike:.2f}"
    if alike < -CORRELATION_LIMIT:
        return seen, "theta_dot counts the other way: turn its sign (sign = -1 in the mapping)"
    if abs(alike) < NO_SPEED:
        return seen, (
            "it is no speed of this angle, or its sign was lost: map its own column, or say "
            'theta_dot = {derive = "theta"}'
        )
    return None


def misread_speed(scale: float) -> str:
    """Say what a speed may be that is so many times the slope of its angle."""
    ratio = 1.0 / abs(scale)
    if GEAR_RATIOS[0] <= ratio <= GEAR_RATIOS[1] and abs(ratio * UNIT_NEAR - 1.0) > UNIT_SPARE:
        return (
            f"theta_dot was divided by a gear ratio of {ratio:.0f} once too often, or theta_dot or "
            "theta is in another unit, or t is"
        )
    return "theta_dot or theta is in another unit, or t is"


def supply_reads(recording: Recording) -> Iterator[Finding]:
    """Rows in which the supply was not read, or failed."""
    supply = recording.voltage
    if supply is not None and (lost := unread_rows(supply)).any():
        yield Examined(recording.name, "voltage").defect(
            f"{rows_text(lost, recording.time)} say {supply[lost].min():.1f}-"
            f"{supply[lost].max():.1f} V where the median is {np.median(supply):.1f} V",
            "the register was not read there, or the supply failed: hold the last "
            "good value, since a simulated motor takes it at its word",
        )


def torque_off(recording: Recording) -> Iterator[Finding]:
    """Segments in which the motor is switched off."""
    off = ~recording.enabled
    if off.all() and (alike := follows(recording)) > LIKE:
        yield Examined(recording.name, "enabled").defect(
            f"the motor is off in all {off.size} rows, though theta follows theta_d (correlation "
            f"{alike:.2f})",
            "enabled is 1 where the motor has torque: turn the column around, or leave it out",
        )
    if not off.any() or off.all():
        return
    edges = np.flatnonzero(np.diff(np.r_[False, off, False]))
    starts, ends = recording.time[edges[::2]], recording.time[edges[1::2] - 1]
    yield Examined(recording.name, "enabled").note(
        f"the motor is off in {off.sum()} of {off.size} rows, {len(starts)} times, first "
        f"from t = {starts[0]:.2f} s to {ends[0]:.2f} s",
        "there the mechanism is alone with gear friction and the rotor: such rows tell "
        "friction from the motor's numbers, and nothing of the loop",
    )


def wrapped(recording: Recording) -> Iterator[Finding]:
    """Registers whose sign was lost."""
    goals = {} if recording.command is None else named_by_tendon("theta_d", recording.command)
    for column, values in (*goals.items(), *measured_channels(recording)):
        lost = lost_sign(values)
        if lost is not None:
            yield Examined(recording.name, column).defect(
                f"{rows_text(lost.rows, recording.time)} stand {lost.period:.6g} too high",
                lost.text,
            )


def dead_channels(recording: Recording) -> Iterator[Finding]:
    """Channels that never change while the shaft moves, and forces that stay at their greatest."""
    moves = np.ptp(recording.motor_position, axis=0) > MOTION_LIMIT
    own = {
        name: bool(moves[place])
        for column in TENDON_COLUMNS
        for place, name in enumerate(names_of(recording, column))
    }
    supply = {} if recording.voltage is None else {"voltage": recording.voltage}
    unread = [item for item in supply.items() if not item[1].any()]
    for column, values in (*measured_channels(recording), *unread):
        if np.ptp(values) == 0.0 and own.get(column, bool(moves.any())):
            yield Examined(recording.name, column).defect(
                f"{values[0]:g} in all {values.size} rows although theta moves",
                "the channel was not measured: remove the column",
            )
    if recording.force is None:
        return
    columns = zip(names_of(recording, "force"), recording.force.T, strict=True)
    for (column, values), theta in zip(columns, recording.motor_position.T, strict=True):
        top = values == values.max()
        way = float(np.ptp(theta[top]))
        far = top.mean() > CLIPPED and way > CLIPPED_WAY * np.ptp(theta)
        # a servo that pulls as strongly as it may is read with the noise of its cell, if it has any
        if far and scatters(values[~top]):
            yield Examined(recording.name, column).caution(
                f"is {values.max():.4g} in {rows_text(top, recording.time)} while theta moves by "
                f"{way:.3g} rad",
                "no sensor reads farther, and a fit takes it for a force: leave those rows out, or "
                "give the cell a wider range",
            )


def resting_position(recording: Recording) -> Iterator[Finding]:
    """A shaft that rests while its goal moves."""
    if recording.command is None:
        return
    for place, column in enumerate(names_of(recording, "theta")):
        theta, goal = recording.motor_position[:, place], recording.command[:, place]
        first, last = longest_rest(recording.time, theta)
        lasting = float(recording.time[last - 1] - recording.time[first])
        if lasting <= STUCK_LIMIT or not recording.enabled[first:last].all():
            continue
        # what the goal does at the end of a rest, a servo that hears late has not followed yet
        late = np.count_nonzero(recording.time <= recording.time[last - 1] - STUCK_LIMIT)
        if (span := float(np.ptp(goal[first:late]))) > MOTION_LIMIT:
            yield Examined(recording.name, column).note(
                f"rests for {lasting:.2f} s from t = {recording.time[first]:.2f} s while "
                f"theta_d moves by {span:.2f} rad",
                "dry friction, a deadband or an end stop holds it, or the encoder "
                "is stuck; such rows say little about anything else",
            )


def unsigned_current(recording: Recording) -> Iterator[Finding]:
    """A current without a sign: the servo brakes and drives both ways, and it is never negative."""
    current = recording.current
    if current is None or current.min() < 0.0 or np.ptp(current) == 0.0:
        return
    if lost_sign(current) is not None:
        return  # its sign is there, read as unsigned
    speed = recording.motor_velocity.max(axis=1)
    forth, back = (float(side.mean()) for side in (speed > 0.0, speed < 0.0))
    if min(forth, back) > SIGN_SHARE:
        yield Examined(recording.name, "current").caution(
            f"never negative, while the shaft turns forth in {100.0 * forth:.0f} % of the "
            f"rows and back in {100.0 * back:.0f} %",
            "its sign was lost: it is a size, and no torque follows from it",
        )


def blocked_rows(theta: Array, goal: Array, side: float) -> Mask:
    """Tell in which rows a shaft rests at the end of its way and its goal comes to lie far beyond.

    All of such a rest counts, from when the shaft arrives to when it leaves.

    Args:
        theta: Shaft angle [rad], shape (T,).
        goal: Commanded angle [rad], shape (T,).
        side: +1 for the upper end, -1 for the lower.
    """
    end = float((side * theta).max())
    rests = side * theta > end - BLOCKED_REST
    held = rests & (side * (goal - theta) > BLOCKED_ERROR)
    if held.sum() < BLOCKED_ROWS:
        return np.zeros(len(theta), dtype=np.bool_)
    rest = np.cumsum(np.diff(rests, prepend=False))
    return rests & np.isin(rest, rest[held])


def unread_rows(voltage: Array) -> Mask:
    """Tell in which rows a supply lies far from all others, shape (T,)."""
    median = float(np.median(voltage))
    if median <= 0.0:
        return np.zeros(voltage.size, dtype=np.bool_)
    return (voltage < SUPPLY_RANGE[0] * median) | (voltage > SUPPLY_RANGE[1] * median)


def measured_channels(recording: Recording) -> Iterator[tuple[str, Array]]:
    """Columns that a sensor or a register gave, by name, shape (T,) each."""
    for column, field in TENDON_COLUMNS.items():
        values = getattr(recording, field)
        if values is not None and field != "command":
            yield from named_by_tendon(column, values).items()
    if recording.current is not None:
        yield "current", recording.current
    for column, values in recording.extra.items():
        if np.issubdtype(values.dtype, np.number) and np.isfinite(values).all():
            yield column, values


def longest_rest(time: Array, values: Array) -> tuple[int, int]:
    """First row and row after the last of the longest stretch without any change."""
    edges = np.flatnonzero(np.r_[True, np.diff(values) != 0.0, True])
    lasting = time[edges[1:] - 1] - time[edges[:-1]]
    longest = int(np.argmax(lasting))
    return int(edges[longest]), int(edges[longest + 1])
