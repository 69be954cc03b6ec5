"""Recordings and models of what a test makes up."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording

Values = Mapping[str, float | str]
SERVO_COLUMNS = ("command", "motor_position", "motor_velocity", "force")


def recorded(
    time: Array, angle: Array, *, name: str = "run.csv", bench: str = "servo", **fields: Any
) -> Recording:
    """Return a recording of motor angles [rad] at times [s]; its speed is their slope by default.

    Columns of one servo may have the shape (T,).
    """
    fields = {"motor_position": angle, **fields}
    if "motor_velocity" not in fields:
        fields["motor_velocity"] = np.gradient(angle, time, axis=0)
    for column in SERVO_COLUMNS:
        if np.ndim(fields.get(column)) == 1:
            fields[column] = fields[column][:, None]
    return Recording(name=name, bench=bench, time=time, **fields)


def stated_model(
    kind: str,
    values: Values | None = None,
    effects: Mapping[str, Values] | None = None,
    **more: Any,
) -> Model:
    """Return a model of a kind of actuator, its numbers, and effects of all servos."""
    return Model(
        actuator=NamedValues(name=kind, values=values or {}),
        effects=tuple(NamedValues(name=n, values=v) for n, v in (effects or {}).items()),
        **more,
    )
