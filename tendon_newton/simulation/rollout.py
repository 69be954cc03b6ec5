"""Recordings of one bench, replayed in closed loop by many candidate models at once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.errors import SimulationDiverged
from tendon_newton.mechanisms.mechanism import Mechanism
from tendon_newton.model_file import Model
from tendon_newton.recording import Array, Recording
from tendon_newton.simulation.assembly import KernelSet, kernel_set
from tendon_newton.simulation.mechanism_arrays import fill_mechanism, plane_of, read_topology
from tendon_newton.simulation.parameter_table import ParameterTable
from tendon_newton.simulation.structure import Precision, Structure, in_catalogue_order
from tendon_newton.simulation.timeline import Timeline, make_timeline

TIME_STEP = 1.25e-4
"""Default step [s]: what it leaves is below a tenth of an encoder's and a load cell's noise.

Measured in tests/physics/test_accuracy.py; 0.25 ms leaves 0.0077 N on a finger with dry friction
at its stops.
"""
THREADS_VARIABLE = "TENDON_NEWTON_THREADS"
"""Environment variable with the number of threads on a CPU; all cores by default."""
CHUNKS_PER_THREAD = 4
"""Launches per thread, so that a slow one does not leave the other thread idle."""


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """What one model made of one recording, at the recording's own rows."""

    time: Array
    """Instants [s], shape (T,)."""
    motor_position: Array
    """Angle that the encoder reports [rad], shape (T, D)."""
    motor_velocity: Array
    """Its rate [rad/s], shape (T, D)."""
    force: Array
    """Tension at the load cell [N], shape (T, D)."""
    joint_position: Array
    """Joint angles [rad] or travels [m], shape (T, J)."""


class Rollout:
    """Kernels and arrays for N models times R recordings, W = N R worlds.

    Args:
        mechanism: The bench that all recordings were made on.
        recordings: R recordings.
        actuator: Kind of the actuator.
        effects: Effects that the kernels hold; a model may leave any of them out.
        spool_radius: Spool radius [m] in place of the asset's.
        time_step: Longest step [s]; each row's interval is divided evenly.
        precision: Scalar of the simulation.
        device: Warp device.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        *,
        actuator: str,
        effects: Sequence[str] = (),
        spool_radius: float | None = None,
        time_step: float = TIME_STEP,
        precision: Precision = "float64",
        device: Any = None,
    ) -> None:
        self.recordings = tuple(recordings)
        self.timelines = tuple(make_timeline(recording) for recording in recordings)
        self.table = ParameterTable(actuator=actuator, effects=in_catalogue_order(tuple(effects)))
        self.time_step = time_step
        model = mechanism.build(
            len(recordings), overrides=[r.bench_overrides for r in recordings], device=device
        )
        if spool_radius is not None:
            set_spool_radius(model, spool_radius)
        topology = read_topology(model)
        self.kernels: KernelSet = kernel_set(
            Structure(
                parents=topology.parents,
                revolute=topology.revolute,
                tendon_count=topology.tendon_count,
                actuator=actuator,
                effects=self.table.effects,
                planar=plane_of(model, topology) is not None,
                precision=precision,
            )
        )
        self.device = model.device
        self.numbers = fill_mechanism(model, self.kernels)
        """The bench's numbers, one world per recording."""
        self.commands = self._fill_commands()
        """The recordings' inputs, one after the other."""
        counts = [len(timeline.time) for timeline in self.timelines]
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32)
        self._row_count = int(sum(counts))

    def base_vectors(self, model: Model) -> Array:
        """Return a model's parameter vector for each recording, shape (R, P)."""
        return np.stack([self.table.vector(model, r.actuator_overrides) for r in self.recordings])

    def run(self, parameters: Array) -> list[list[Trajectory]]:
        """Simulate every recording with every candidate.

        Args:
            parameters: Vectors of the candidates for each recording, shape (N, R, P).

        Returns:
            One trajectory per candidate and recording.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        arrays = self.run_rows(parameters)
        if not np.isfinite(arrays["joints"]).all():
            raise SimulationDiverged(
                f"the simulation of {self.recordings[0].bench!r} must stay finite; "
                f"it did not at steps of {self.time_step} s"
            )
        return [
            [self._trajectory(arrays, n, r) for r in range(len(self.recordings))]
            for n in range(len(parameters))
        ]

    def run_rows(self, parameters: Array, time_step: float | None = None) -> dict[str, Array]:
        """Simulate as `run`, and return arrays over all simulated rows S.

        They are ``angle``, ``rate``, ``force`` (N, S, D) and ``joints`` (N, S, J). Where a
        candidate's numbers make the simulation diverge its rows are not finite; the others are
        unharmed.
        """
        types = self.kernels.types
        candidates, recordings = parameters.shape[:2]
        worlds = candidates * recordings
        rows = candidates * self._row_count
        world_recording = np.tile(np.arange(recordings, dtype=np.int32), candidates)
        first = self._first[world_recording] + self._row_count * np.repeat(
            np.arange(candidates, dtype=np.int32), recordings
        )
        recording = self.array(world_recording, wp.int32)
        vectors = self.array(parameters.reshape(worlds, -1), types["ParameterVector"])
        q = wp.zeros(worlds, dtype=types["JointVector"], device=self.device)
        v = wp.zeros_like(q)
        memory = wp.zeros(worlds, dtype=types["MemoryVector"], device=self.device)
        joints = wp.zeros(rows, dtype=types["JointVector"], device=self.device)
        angle, rate, force = (
            wp.zeros(rows, dtype=types["TendonVector"], device=self.device) for _ in range(3)
        )
        common = [self.numbers, recording, recording, vectors, self.commands]
        outputs = [self.array(first, wp.int32), joints, angle, rate, force]
        span = [0, 1 << 30, types["real"](time_step or self.time_step)]
        self._launch(self.kernels.settle, worlds, [*common, q, v, memory])
        self._launch(self.kernels.rollout, worlds, [*common, *span, q, v, memory, *outputs])
        shape = (candidates, self._row_count, -1)
        signals: dict[str, Any] = {"angle": angle, "rate": rate, "force": force, "joints": joints}
        return {name: signal.numpy().reshape(shape) for name, signal in signals.items()}

    def rows_of(self, recording: int) -> slice:
        """Return where a recording's simulated rows stand among all."""
        start = int(self._first[recording])
        return slice(start, start + len(self.timelines[recording].time))

    def _launch(self, kernel: wp.Kernel, worlds: int, arguments: list[Any]) -> None:
        """Launch over all worlds; on a CPU in chunks on every core, as Warp itself uses one."""
        if self.device.is_cuda:
            wp.launch(kernel, worlds, inputs=[0, *arguments], device=self.device)
            return
        threads = min(worlds, int(os.environ.get(THREADS_VARIABLE, os.cpu_count() or 1)))
        edges = np.unique(np.linspace(0, worlds, threads * CHUNKS_PER_THREAD + 1).astype(int))
        commands = [
            wp.launch(
                kernel, int(end - start), inputs=[int(start), *arguments],
                device=self.device, record_cmd=True,
            )
            for start, end in pairwise(edges)
        ]  # fmt: skip
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda command: command.launch(), commands))

    def _trajectory(self, arrays: dict[str, Array], candidate: int, recording: int) -> Trajectory:
        timeline = self.timelines[recording]
        rows = self._first[recording] + timeline.measured
        return Trajectory(
            time=self.recordings[recording].time,
            motor_position=arrays["angle"][candidate, rows],
            motor_velocity=arrays["rate"][candidate, rows],
            force=arrays["force"][candidate, rows],
            joint_position=arrays["joints"][candidate, rows],
        )

    def array(self, values: Any, dtype: Any) -> Any:
        """Copy numbers to the device, in the kernels' precision."""
        scalar = values.dtype
        if scalar != np.int32:
            scalar = np.dtype(self.kernels.structure.precision)
        return wp.array(np.ascontiguousarray(values, dtype=scalar), dtype=dtype, device=self.device)

    def _fill_commands(self) -> Any:
        """Lay the recordings' inputs out for the kernels, one after the other."""
        types = self.kernels.types
        commands = types["Commands"]()
        counts = np.array([len(t.time) for t in self.timelines], dtype=np.int32)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32)
        inputs = [row_inputs(r, t) for r, t in zip(self.recordings, self.timelines, strict=True)]
        commands.first = self.array(first, wp.int32)
        commands.count = self.array(counts, wp.int32)
        # Time counts from the recording's first row: float32 would lose microseconds after minutes.
        times = np.concatenate([t.time - t.time[0] for t in self.timelines])
        commands.time = self.array(times, types["real"])
        commands.angle = self.array(
            np.concatenate([t.command for t in self.timelines]), types["TendonVector"]
        )
        commands.voltage = self.array(np.concatenate([i[0] for i in inputs]), types["real"])
        commands.enabled = self.array(np.concatenate([i[1] for i in inputs]), types["real"])
        measured = np.array([r.start == "first_row" for r in self.recordings], dtype=np.int32)
        commands.starts_measured = self.array(measured, wp.int32)
        commands.start_angle = self.array(
            np.stack([r.motor_position[0] for r in self.recordings]), types["TendonVector"]
        )
        commands.start_rate = self.array(
            np.stack([r.motor_velocity[0] for r in self.recordings]), types["TendonVector"]
        )
        return commands


def row_inputs(recording: Recording, timeline: Timeline) -> tuple[Array, Array]:
    """Return the supply voltage [V] and torque enabled (0 or 1) of the simulated rows, shapes (S,).

    The voltage is 0 where it was not logged.
    """
    source = np.searchsorted(timeline.measured, np.arange(len(timeline.time)), side="right") - 1
    voltage = np.zeros(len(recording.time)) if recording.voltage is None else recording.voltage
    return voltage[source], recording.enabled.astype(np.float64)[source]


def set_spool_radius(model: Any, radius: float) -> None:
    """Write the spool radius [m] of every tendon that is wound; a direct drive has none."""
    tendon = model.tendon
    radii = np.where(tendon.direct.numpy() > 0, tendon.spool_radius.numpy(), radius)
    tendon.spool_radius.assign(radii.astype(np.float32))
