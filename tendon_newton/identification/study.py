"""Measured recordings beside what candidate models make of them: the residuals of every fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.identification.noise_floor import estimate_noise_floor
from tendon_newton.mechanisms.mechanism import Mechanism
from tendon_newton.model_file import Model
from tendon_newton.recording import Array, Indices, Mask, Recording
from tendon_newton.simulation.load_cell import (
    fill_between_readings,
    first_reading,
    reading_stride,
)
from tendon_newton.simulation.parameter_table import ParameterTable, spool_radius_of
from tendon_newton.simulation.replay import bench_of
from tendon_newton.simulation.rollout import TIME_STEP, Rollout, Trajectory
from tendon_newton.simulation.timeline import Timeline

DIVERGED = 1.0e4
"""Stands for an angle [rad] or force [N] that is not finite."""


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Measured minus simulated, for N candidates on one recording."""

    theta: Array
    """Motor angle [rad], shape (N, T)."""
    force: Array | None
    """Tension [N], shape (N, T); None without a load cell."""
    trusted: Mask
    """Rows whose past is known, shape (T,)."""


class Study:
    """A dataset's recordings, ready to be compared with any number of candidate models.

    Args:
        recordings: Recordings of one or several benches, one tendon each.
        model: The model to start from.
        effects: Effects that candidates may use.
        time_step: Step of the simulation [s].
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        model: Model,
        effects: Sequence[str],
        *,
        time_step: float = TIME_STEP,
    ) -> None:
        self.recordings = tuple(recordings)
        self.table = ParameterTable(actuator=model.actuator.name, effects=())
        self.noise = estimate_noise_floor(self.recordings)
        self.mechanisms: list[Mechanism] = []
        self._groups: list[tuple[Rollout, tuple[int, ...]]] = []
        for bench in dict.fromkeys(r.bench for r in self.recordings):
            members = tuple(i for i, r in enumerate(self.recordings) if r.bench == bench)
            mechanism = bench_of(bench, model)
            self.mechanisms.append(mechanism)
            rollout = Rollout(
                mechanism,
                [self.recordings[i] for i in members],
                actuator=model.actuator.name,
                effects=effects,
                spool_radius=spool_radius_of(model),
                time_step=time_step,
            )
            self.table = rollout.table
            self._groups.append((rollout, members))
        self._vectors = [rollout.base_vectors(model) for rollout, _ in self._groups]
        self._cells = [find_cell(r, self.timeline(i)) for i, r in enumerate(self.recordings)]

    def timeline(self, index: int) -> Timeline:
        """Return the simulated rows of one recording."""
        for rollout, members in self._groups:
            if index in members:
                return rollout.timelines[members.index(index)]
        raise IndexError(index)

    def base_value(self, column: int) -> float:
        """Return the model's own value of one parameter; the first recording's, if they differ."""
        return float(self._vectors[0][0, column])

    def residuals(
        self, columns: Indices, values: Array, time_step: float | None = None
    ) -> list[Residual]:
        """Simulate N candidates on every recording and compare.

        Args:
            columns: Parameters that each candidate replaces, shape (N, F); -1 for none.
            values: Values in place of the model's own, shape (N, F), or (N, R, F) where each
                recording has its own.
            time_step: Step of the simulation [s] in place of the study's.
        """
        out: dict[int, Residual] = {}
        per_recording = values.ndim == 3
        for (rollout, members), base in zip(self._groups, self._vectors, strict=True):
            vectors = np.repeat(base[None], len(values), axis=0)
            for n, row in enumerate(columns):
                for f in np.flatnonzero(row >= 0):
                    vectors[n, :, row[f]] = values[n, members, f] if per_recording else values[n, f]
            rows = rollout.run_rows(vectors, time_step)
            for place, index in enumerate(members):
                out[index] = self._compare(index, rollout, place, rows)
        return [out[index] for index in range(len(self.recordings))]

    def trajectories(self, values: Mapping[int, float]) -> list[Trajectory]:
        """Simulate every recording with some of the model's numbers replaced (column -> value)."""
        out: dict[int, Trajectory] = {}
        for (rollout, members), base in zip(self._groups, self._vectors, strict=True):
            vectors = base[None].copy()
            vectors[:, :, list(values)] = list(values.values())
            out.update(zip(members, rollout.run(vectors)[0], strict=True))
        return [out[index] for index in range(len(self.recordings))]

    def _compare(
        self, index: int, rollout: Rollout, place: int, rows: dict[str, Array]
    ) -> Residual:
        recording, timeline = self.recordings[index], rollout.timelines[place]
        span = rollout.rows_of(place)
        theta = finite(rows["angle"][:, span, 0])[:, timeline.measured]
        force = None
        if recording.force is not None:
            simulated = finite(rows["force"][:, span, 0])
            if (cell := self._cells[index]) is not None:
                simulated = fill_between_readings(simulated, *cell)
            force = recording.force[None, :, 0] - simulated[:, timeline.measured]
        return Residual(
            theta=recording.motor_position[None, :, 0] - theta,
            force=force,
            trusted=timeline.trusted,
        )


def replacements(models: Sequence[Mapping[int, float]]) -> tuple[Indices, Array]:
    """Return what `Study.residuals` takes, for candidates given as parameter column -> value."""
    width = max(1, max(len(model) for model in models))
    columns = np.full((len(models), width), -1, dtype=np.intp)
    values = np.zeros((len(models), width))
    for n, model in enumerate(models):
        columns[n, : len(model)] = list(model.keys())
        values[n, : len(model)] = list(model.values())
    return columns, values


def finite(signal: Array) -> Array:
    """Replace what diverged by a number that no fit will like."""
    return np.clip(np.nan_to_num(signal, nan=DIVERGED), -DIVERGED, DIVERGED)


def find_cell(recording: Recording, timeline: Timeline) -> tuple[int, int] | None:
    """Return (first row read, rows per reading) of a slow load cell, None for a fast one."""
    if recording.force is None or recording.load_cell_rate is None:
        return None
    stride = reading_stride(recording.load_cell_rate, timeline.time)
    if stride <= 1:
        return None
    return first_reading(recording.force[:, 0], timeline.measured, stride), stride
