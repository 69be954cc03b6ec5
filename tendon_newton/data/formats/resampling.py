"""Streams at their own times as the rows of one recording: what is held, what is interpolated.

The rows are the servo's readings at their real times; nothing is moved onto a grid.

- A command is held: a row has the last command sent before it.
- The load cell and the tip are slower or not in step with the servo. Between two readings they are
  interpolated linearly; before the first and after the last they are held for one period.
- The tip is bridged for up to 0.25 s, which cameras lose now and then.
- A row has no force where the load cell was silent, and a recording has no place for a row without
  force: such rows are left out, and so they show as a gap.
- Voltage and temperature change slowly and are interpolated linearly.
"""

import logging
from collections.abc import Mapping
from typing import Any

import numpy as np

from tendon_newton.data.formats.message_streams import Nanoseconds, Stream
from tendon_newton.data.formats.topic_mapping import TopicMapping
from tendon_newton.data.recording import Array, Mask
from tendon_newton.errors import InvalidRecording

SILENCE = 3.0
"""Periods without a reading after which a sensor counts as silent [1]: one or two lost lines are
bridged by a straight line, a pause is not."""
TIP_BRIDGE = 0.25  # Longest time without a tip that is drawn as a straight line [s]

log = logging.getLogger(__name__)


def rows_of(streams: Mapping[str, Stream], mapping: TopicMapping, name: str) -> dict[str, Any]:
    """Bring the streams of a recording to its rows.

    Args:
        mapping: Whether theta_dot is derived, and what may be absent.

    Returns:
        Field of a recording -> array, and ``extra`` columns.
    """
    theta = distinct(streams["theta"], name)
    keep = np.ones(theta.time.size, dtype=np.bool_)
    fields: dict[str, Any] = {"motor_position": theta.values}
    fields["motor_velocity"] = (
        central_difference(theta, name)
        if mapping.differentiate
        else matched(streams["theta_dot"], theta, keep, "theta_dot", name)
    )
    if command := streams.get("theta_d"):
        fields["command"] = held(command, theta, keep)
    if force := streams.get("force"):
        fields["force"] = interpolated(tendons_first(force, theta), theta.time, keep)
    if "tip_x" in streams and "tip_z" in streams:
        parts = [
            interpolated(streams[column], theta.time, keep, bridge=TIP_BRIDGE)[:, 0]
            for column in ("tip_x", "tip_z")
        ]
        fields["tip"] = np.column_stack(parts)
    for column in ("voltage", "temperature"):
        if (slow := streams.get(column)) and not np.isnan(slow.values).all():
            fields[column] = slow_values(slow, theta.time)
    if enabled := streams.get("enabled"):
        fields["enabled"] = held(enabled, theta, keep)[:, 0] != 0.0
    extra = currents(streams, theta, fields)
    refuse_emptiness(keep, theta.time, name)
    fields = {field: values[keep] for field, values in fields.items()}
    rows = theta.time[keep]
    fields["time"] = 1e-9 * (rows - rows[0])
    fields["extra"] = {column: values[keep] for column, values in extra.items()}
    return fields


def refuse_emptiness(keep: Mask, time: Nanoseconds, name: str) -> None:
    """Say how many rows are left out, and refuse a recording of which too few are left."""
    lost = int(np.count_nonzero(~keep))
    if keep.size - lost < 2:
        raise InvalidRecording(
            f"{name}: a recording needs two rows or more at which all of its topics tell "
            f"something; {keep.size - lost} of {keep.size} servo readings are left"
        )
    if lost:
        first = 1e-9 * (time[np.flatnonzero(~keep)[0]] - time[0])
        log.warning(
            "%s: %d of %d rows are left out: the command, the load cell or the tip tells nothing "
            "there (first at %.2f s)",
            name,
            lost,
            keep.size,
            first,
        )


def distinct(stream: Stream, name: str) -> Stream:
    """Leave out readings that repeat the instant of the one before."""
    new = np.diff(stream.time, prepend=stream.time[0] - 1) > 0
    if not new.all():
        log.warning("%s: %d servo readings repeat an instant and are left out", name, np.sum(~new))
    return Stream(time=stream.time[new], values=stream.values[new], names=stream.names)


def central_difference(theta: Stream, name: str) -> Array:
    """Differentiate the angle, as a mapping asks for it."""
    if theta.time.size < 2:
        raise InvalidRecording(f"{name}: a speed needs two readings; there is one")
    return np.gradient(theta.values, 1e-9 * (theta.time - theta.time[0]), axis=0)


def matched(stream: Stream, theta: Stream, keep: Mask, column: str, name: str) -> Array:
    """Return the speeds of the readings; from the same messages they need no interpolation."""
    if stream.values.shape[1] != theta.values.shape[1]:
        raise InvalidRecording(
            f"{name}: {column} must have one value per tendon as theta has, "
            f"{theta.values.shape[1]}; it has {stream.values.shape[1]}"
        )
    same = np.searchsorted(stream.time, theta.time)
    same = np.minimum(same, stream.time.size - 1)
    if np.array_equal(stream.time[same], theta.time):
        return stream.values[same]
    return interpolated(stream, theta.time, keep)


def held(stream: Stream, theta: Stream, keep: Mask) -> Array:
    """Return the last value before each row; rows before the first value are not kept."""
    place = np.searchsorted(stream.time, theta.time, side="right") - 1
    keep &= place >= 0
    return stream.values[np.maximum(place, 0)]


def interpolated(stream: Stream, rows: Nanoseconds, keep: Mask, *, bridge: float = 0.0) -> Array:
    """Return values at the rows; rows where the sensor is silent are not kept.

    Args:
        rows: Instants [ns], shape (T,).
        keep: Rows to keep, shape (T,); cleared where there is no value.
        bridge: Silence that counts as none [s], if it is longer than a few periods.
    """
    time = stream.time
    if time.size == 1:
        keep &= rows == time[0]
        return np.repeat(stream.values, rows.size, axis=0)
    after = np.clip(np.searchsorted(time, rows), 1, time.size - 1)
    period = float(np.median(np.diff(time)))
    silent = np.diff(time)[after - 1] > max(SILENCE * period, 1e9 * bridge)
    at_reading = (rows == time[after]) | (rows == time[after - 1])
    margin = max(period, 1e9 * bridge)
    outside = (rows < time[0] - margin) | (rows > time[-1] + margin)
    keep &= ~outside & (~silent | at_reading | (rows < time[0]) | (rows > time[-1]))
    origin = int(rows[0])
    at, of = (rows - origin).astype(np.float64), (time - origin).astype(np.float64)
    columns: list[Array] = [np.interp(at, of, values) for values in stream.values.T]
    return np.column_stack(columns)


def slow_values(stream: Stream, rows: Nanoseconds) -> Array:
    """Return a slow quantity at the rows."""
    origin = int(rows[0])
    return np.interp(
        (rows - origin).astype(np.float64),
        (stream.time - origin).astype(np.float64),
        stream.values[:, 0],
    )


def tendons_first(force: Stream, theta: Stream) -> Stream:
    """Bring load cells into the order of the tendons, by the names that both give."""
    if not theta.names or set(force.names) != set(theta.names):
        return force
    order = [force.names.index(name) for name in theta.names]
    return Stream(time=force.time, values=force.values[:, order], names=theta.names)


def currents(
    streams: Mapping[str, Stream], theta: Stream, fields: dict[str, Any]
) -> dict[str, Array]:
    """Set the motor current, or one unknown column per tendon; NaN says that none is measured."""
    stream = streams.get("current")
    if stream is None or np.isnan(stream.values).all():
        return {}
    everywhere = np.ones(theta.time.size, dtype=np.bool_)
    values = interpolated(stream, theta.time, everywhere)
    if values.shape[1] == 1:
        fields["current"] = values[:, 0]
        return {}
    return {f"current_{place}": column for place, column in enumerate(values.T)}
