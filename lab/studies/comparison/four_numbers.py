"""The baseline that anyone writes in an hour: lag, delay, deadband and offset, and no physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.recording import Array

STEP = 0.005  # Step of the grid on which logs are compared [s]
STARTS = ((0.02, 0.1, 0.5), (0.0, 0.03), (0.001, 0.03), (-0.1, 0.0, 0.1))
"""Lags [s], delays [s], deadbands [rad] and offsets [rad] where fits begin."""
FOLLOWED = 2


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Logs on common instants, shape (T, R); rows behind a log's end count for nothing."""

    command: Array
    position: Array
    enabled: Array
    valid: Array


def grid_of(logs: Sequence[ImportedLog]) -> Grid:
    """Put logs on one grid of instants."""
    recordings = [log.recording for log in logs]
    longest = max(r.duration for r in recordings)
    instants = np.arange(0.0, longest, STEP)
    columns: dict[str, list[Array]] = {"command": [], "position": [], "enabled": [], "valid": []}
    for recording in recordings:
        time = recording.time - recording.time[0]
        assert recording.command is not None
        on = np.ones_like(time) if recording.enabled is None else recording.enabled.astype(float)
        columns["command"].append(np.interp(instants, time, recording.command[:, 0]))
        columns["position"].append(np.interp(instants, time, recording.motor_position[:, 0]))
        columns["enabled"].append(np.interp(instants, time, on))
        columns["valid"].append((instants <= time[-1]).astype(float))
    return Grid(**{name: np.stack(rows, axis=1) for name, rows in columns.items()})


def simulate(grid: Grid, numbers: Array) -> Array:
    """Return the angle [rad], shape (T, R), by lag, delay, deadband and offset.

    A goal within the deadband moves nothing, nor does a motor that is off.
    """
    lag, delay, deadband, offset = numbers
    goal = delayed(grid.command, abs(delay) / STEP)
    share = 1.0 - np.exp(-STEP / max(abs(lag), 1e-4))
    angle = grid.position[0].copy()
    out = np.empty_like(grid.position)
    for row in range(out.shape[0]):
        out[row] = angle
        error = goal[row] + offset - angle
        moved = np.sign(error) * np.maximum(np.abs(error) - abs(deadband), 0.0)
        angle = angle + share * moved * (grid.enabled[row] > 0.5)
    return out


def delayed(command: Array, rows: float) -> Array:
    """Return a command that comes some rows late, shape (T, R)."""
    places = np.maximum(np.arange(command.shape[0]) - rows, 0.0)
    before = places.astype(np.intp)
    after = np.minimum(before + 1, command.shape[0] - 1)
    share = (places - before)[:, None]
    return (1.0 - share) * command[before] + share * command[after]


def mean_error(grid: Grid, numbers: Array) -> float:
    """Return the mean absolute error over logs and rows [rad]."""
    missed = np.abs(simulate(grid, numbers) - grid.position) * grid.valid
    return float((missed.sum(axis=0) / grid.valid.sum(axis=0)).mean())


def fitted(grid: Grid) -> Array:
    """Return the four numbers that fit some logs best: the best of a table, followed downhill."""
    starts = sorted(product(*STARTS), key=lambda numbers: mean_error(grid, np.array(numbers)))
    found = [
        minimize(lambda x: mean_error(grid, x), start, method="Nelder-Mead", tol=1e-6)
        for start in starts[:FOLLOWED]
    ]
    return min(found, key=lambda result: result.fun).x
