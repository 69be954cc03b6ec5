"""Recordings of one bench, replayed in closed loop by many candidate models at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.actuators import find_actuator
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.checks.first_rows import first_row, start_of
from tendon_newton.data.checks.lint_checks import blocked_rows
from tendon_newton.data.checks.measures import supply_of
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, DrivenBy, Indices, Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.device_code.kernel_loading import load_kernels
from tendon_newton.device_code.placeholders import ParameterVector, TendonVector, real
from tendon_newton.device_code.structs import Commands, Readout, Rows, States, Worlds
from tendon_newton.device_code.structs import Mechanism as MechanismNumbers
from tendon_newton.effects import EFFECTS, Stage, find_effect
from tendon_newton.errors import (
    InvalidModelFile,
    InvalidParameter,
    InvalidRecording,
    SimulationDiverged,
)
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.dynamics.settling import (
    AS_MEASURED,
    FROM_SPRINGS,
    IF_HELD,
    NEAR_MEASURED,
)
from tendon_newton.simulation.hosts.chain_layout import ChainLayout
from tendon_newton.simulation.hosts.force_source import Equation, ForceSource
from tendon_newton.simulation.hosts.launch import Launch
from tendon_newton.simulation.hosts.measured_motion import led_timeline
from tendon_newton.simulation.hosts.query_rows import NONE_LEFT
from tendon_newton.simulation.hosts.rollout_servos import RolloutServos
from tendon_newton.simulation.hosts.timeline import Timeline, make_timeline
from tendon_newton.simulation.kernels.position_kernels import POSITION_STEP
from tendon_newton.simulation.model.assembly import KernelSet, kernel_set, kinematic_effects
from tendon_newton.simulation.model.bench_numbers import WRITTEN, BenchNumber, write_by_chain
from tendon_newton.simulation.model.chain_copies import copies_of, refuse_copies
from tendon_newton.simulation.model.kernel_arrays import struct_of, zeros
from tendon_newton.simulation.model.mechanism_arrays import (
    PUSH_FORCE,
    fill_mechanism,
    plane_of,
    read_topology,
    spools_are_free,
)
from tendon_newton.simulation.model.parameter_table import (
    force_limit_of,
    spool_radius_of,
    stiffness_of,
    table_of,
)
from tendon_newton.simulation.model.structure import Structure
from tendon_newton.simulation.tendons.measured_force import acts, has_spring

TIME_STEP = 1.25e-4
"""Default step [s]: what it leaves is below a tenth of an encoder's and a load cell's noise.

Measured in tests/physics/test_accuracy.py; 0.25 ms leaves 0.0077 N on a finger with dry friction
at its stops.
"""
# What simulated rows have, and where kernels write it
SIGNALS = {
    "angle": "motor_position",
    "rate": "motor_velocity",
    "force": "force",
    "joints": "joint_position",
}
FURTHER = {
    "tip": "joint_position",
    "current": "current",
    "voltage": "current",
}  # What they may have besides, where it is asked for
# The stages in which further sensors read a signal
READINGS = {
    "joints": Stage.JOINT_READING,
    "tip": Stage.TIP_READING,
    "current": Stage.CURRENT_READING,
    "voltage": Stage.VOLTAGE_READING,
}
NEVER = 1 << 30  # A row that no recording has


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """What one model made of one recording, at the recording's own rows."""

    time: Array
    """Instants [s], shape (T,)."""
    motor_position: Array
    """Angle that the encoder reports [rad], shape (T, D)."""
    motor_velocity: Array
    """Rate of the motor angle [rad/s], shape (T, D)."""
    force: Array
    """Tension at the load cell [N], shape (T, D)."""
    joint_position: Array
    """Joint angles [rad] or travels [m], shape (T, J)."""


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """What candidate models may differ in, beside the numbers of the actuator."""

    effects: Sequence[str] | None = None
    """Effects that the kernels hold, and effects of one servo, such as ``gain_error of servo 1``; a
    candidate may leave any of them out. Those of the model where none are named."""
    shared: Sequence[str] = ()
    """Effects among those of single servos that candidates may also give to all at once."""
    unknown: Sequence[BenchNumber] = ()  # Numbers of this and other benches


@dataclass(frozen=True, kw_only=True)
class Stepping:
    """How worlds are stepped."""

    time_step: float = TIME_STEP  # Longest step [s]; each row's interval is divided evenly
    # Whether kernels see each of K equal chains of a mechanism, such as a hand's, as one of its
    # own, as long as no network is asked for them together
    by_chain: bool = True


class Rollout:
    """Kernels and arrays for N models times R recordings, W = N R worlds.

    Args:
        mechanism: The bench that all recordings were made on.
        recordings: R recordings, all with commands or all without.
        model: Kind of the actuator, and the servo's numbers that no candidate changes.
        candidates: What the models may differ in.
        force: Where the actuator's force comes from; by default its equation.
        stepping: How their worlds are stepped.
        device: Warp device.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        model: Model,
        *,
        candidates: Candidates | None = None,
        force: ForceSource | None = None,
        stepping: Stepping | None = None,
        device: Any = None,
    ) -> None:
        actuator, stiffness = model.actuator.name, stiffness_of(model)
        candidates, stepping = candidates or Candidates(), stepping or Stepping()
        mechanism.refuse_moving_obstacle("Rollout")
        refuse_drive(mechanism, recordings, actuator)
        self.recordings = tuple(recordings)
        overrides = [recording.bench_overrides for recording in recordings]
        self._benches = [override_mechanism(mechanism, own) for own in overrides]
        self.driven_by: DrivenBy = drive_of(recordings)
        """Without commands the path under a load, or the measured force, drives the mechanism."""
        self._kinematic = find_actuator(actuator).kinematic
        self._has_spring = tuple(has_spring(mechanism, own) for own in overrides)
        self.force = force or Equation()
        """Where the actuator's force comes from."""
        self.timelines = tuple(
            self.force.timeline(timeline_of(recording, stiffness if spring else 0.0, actuator))
            for recording, spring in zip(recordings, self._has_spring, strict=True)
        )
        self._unknown = tuple(candidates.unknown)
        own = [number.is_of(recordings[0].bench) for number in self._unknown]
        self._is_own = np.array(own, dtype=bool)
        self.time_step = stepping.time_step
        worlds = build_model(mechanism, len(recordings), overrides=overrides, device=device)
        self.device = worlds.device
        set_servos(worlds, model)
        if self.driven_by == "force":
            release_limits(worlds)
        self._assemble(worlds, model, candidates, stepping)
        self.numbers = fill_mechanism(worlds, self.kernels)
        """The bench's numbers, one world per recording."""
        self.commands = self._fill_commands()
        """The recordings' inputs, one after the other."""
        self._first = starts_of(self._chains.rows)
        if self._kinematic:
            given = [(r.joint_load, np.zeros(len(r.time))) for r in self.recordings]
            self.load([none if load is None else load for load, none in given])

    def _assemble(
        self, worlds: Any, model: Model, candidates: Candidates, stepping: Stepping
    ) -> None:
        """Decide what the kernels are, and where numbers of models and rows stand for them."""
        own = [effect.cause for effect in model.effects]
        whole, divided = read_topology(worlds), copies_of(worlds)
        self.table = table_of(
            model.actuator.name, own if candidates.effects is None else candidates.effects,
            whole.tendon_count, shared=tuple(candidates.shared), independent=divided.independent,
            bench=tuple(number.parameter for number in self._unknown),
        )  # fmt: skip
        by_chain = stepping.by_chain and not self.force.is_network
        if self.table.by_servo and not by_chain:
            refuse_copies(divided, self.table.by_servo)
        topology, copies = (divided.topology, divided.count) if by_chain else (whole, 1)
        counts = np.array([len(timeline.time) for timeline in self.timelines])
        self._chains = ChainLayout(count=copies, rows=counts)
        commanded = self.driven_by == "command"
        self.kernels: KernelSet = kernel_set(
            Structure(
                **vars(topology),
                actuator=self.table.actuator,
                effects=self.table.effects,
                by_servo=self.table.of_chain(copies).by_servo,
                planar=plane_of(worlds, whole) is not None,
                driven_by=self.driven_by,
                free_spool=commanded and spools_are_free(worlds, self.table.actuator),
            )
        )
        if self.kernels.structure.holds_force != self.force.is_network:
            raise InvalidParameter(
                f"a {self.table.actuator!r} actuator needs the force of "
                f"{'a network' if self.kernels.structure.holds_force else 'its equation'}; "
                f"it was given {type(self.force).__name__}"
            )

    def base_vectors(self, model: Model) -> Array:
        """Return a model's parameter vector for each recording, shape (R, P)."""
        if self._kinematic:
            refuse_effects(model, kinematic_effects(self.driven_by))
        model = self.force.completed(model)
        free = [n.key for n, own in zip(self._unknown, self._is_own, strict=True) if own]
        vectors = [
            self.table.vector(
                model.on_bench(r.bench, r.bench_overrides, free), r.actuator_overrides
            )
            for r in self.recordings
        ]
        if self.driven_by == "force":
            for vector, spring in zip(vectors, self._has_spring, strict=True):
                self._silence(vector, spring)
        return np.stack(vectors)

    def _silence(self, vector: Array, spring: bool) -> None:
        """Put those effects at null that have no place where the force is measured."""
        null = self.table.null_vector()
        for cause in dict.fromkeys(owner for owner, _ in self.table.owners):
            if effect_of(cause) in EFFECTS and not acts(effect_of(cause), has_spring=spring):
                columns = list(self.table.columns(cause))
                vector[columns] = null[columns]

    def shows(self, effect: str) -> bool:
        """Tell whether an effect of the catalogue can act in any of the recordings."""
        if self._kinematic:
            return effect in kinematic_effects(self.driven_by)
        if self.driven_by == "command":
            return True
        return any(acts(effect, has_spring=spring) for spring in self._has_spring)

    def shake(self, size: float, rng: np.random.Generator) -> None:
        """Add noise of a size [rad, N] to the inputs as recorded; zero takes it away again."""
        inputs = np.concatenate([timeline.command for timeline in self.timelines])
        noisy = inputs + size * rng.standard_normal(inputs.shape)
        self.commands.angle = self.array(
            self._chains.by_row(noisy), self.kernels.types[TendonVector]
        )

    def load(self, loads: Sequence[Array]) -> None:
        """Put loads on the joints of a mechanism without force [N m], shape (T,) of each log."""
        pairs = zip(self.timelines, self.recordings, loads, strict=True)
        rows = [np.interp(t.time, r.time, own) for t, r, own in pairs]
        self.commands.load = self.array(np.concatenate(rows), self.kernels.types[real])

    def run(self, parameters: Array) -> list[list[Trajectory]]:
        """Simulate every recording with the vectors (N, R, P) of every candidate.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        arrays = self.run_rows(parameters)
        if not np.isfinite(arrays["joints"]).all():
            raise SimulationDiverged(
                f"the simulation of {self.recordings[0].bench!r} must stay finite; "
                f"it did not at steps of {self.time_step} s"
            )
        return self.trajectories(arrays)

    def run_rows(
        self,
        parameters: Array,
        time_step: float | None = None,
        signals: Sequence[str] = tuple(SIGNALS),
    ) -> dict[str, Array]:
        """Simulate as `run`, and return signals over all simulated rows S.

        They are ``angle``, ``rate``, ``force`` (N, S, D) and ``joints`` (N, S, J), or those that
        are asked for, also ``tip`` (N, S, 2), ``current`` (N, S, D) and ``voltage`` (N, S, 2): a
        motor's force [N] and the share by which its supply is read lower. Where a candidate's
        numbers make the simulation diverge its rows are not finite; the others are unharmed.
        Candidates between which a recording's chain feels no difference, such as in another
        finger's friction, share a world.
        """
        vectors, bench = self._of_chains(parameters)
        chains, counts = len(self.commands.count), self.commands.count.numpy()
        each = np.arange(len(vectors), dtype=np.float64)[:, None] % chains
        found, world_of = distinct(np.concatenate([each, vectors, bench], axis=1))
        world_recording = found % chains
        launch = self._launch(vectors[found], bench[found], world_recording)
        types, first = self.kernels.types, starts_of(counts[world_recording])
        readout = zeros(types, Readout, int(counts[world_recording].sum()), device=self.device)
        step = time_step or self.time_step
        step = types[real](max(step, POSITION_STEP) if self._kinematic else step)
        self._simulate(launch, step, self.array(first.astype(np.int32), wp.int32), readout)
        ahead = first[world_of].reshape(-1, chains) - self.commands.first.numpy()
        rows = np.repeat(ahead, counts, axis=1) + np.arange(counts.sum())
        out = {}
        for name in signals:
            source = (SIGNALS | FURTHER)[name]
            signal = getattr(readout, source).numpy()
            width = self.kernels.structure.joint_count if source == "joint_position" else None
            values = signal.reshape(len(signal), -1)[:, :width]
            out[name] = self._chains.beside(values[rows])
        if "tip" in out:
            out["tip"] = self._tips(out["tip"], parameters)
        if "voltage" in out:  # of an only servo whose model states no torque constant
            out["voltage"] = np.concatenate([out["voltage"], 0.0 * out["voltage"]], axis=-1)
        for name in out.keys() & READINGS.keys():
            self._read(READINGS[name], out[name], parameters)
        return out

    def _read(self, stage: Stage, signal: Array, parameters: Array) -> None:
        """Put what a further sensor reads in place of a signal (N, S, C), by vectors (N, R, P)."""
        for effect in map(find_effect, self.table.effects):
            reading = effect.hook(stage)
            if reading is None:
                continue
            values = parameters[..., list(self.table.columns(effect.name))]
            null = [parameter.null for parameter in effect.parameters]
            for n, r in np.argwhere((values != null).any(axis=-1)):
                rows = self.rows_of(r)
                if np.isfinite(signal[n, rows]).all():
                    signal[n, rows] = reading(signal[n, rows], self.timelines[r].time, values[n, r])

    def _tips(self, joints: Array, parameters: Array) -> Array:
        """Return x and z of the tip [m] where joints are (N, S, J), by vectors (N, R, P)."""
        first = self.table.bench_columns.start
        own = [first + k for k, number in enumerate(self._unknown)
               if self._is_own[k] and number.key == "length"]  # fmt: skip
        out = np.empty((*joints.shape[:2], 2))
        for r, stated in enumerate(self._benches):
            rows, lengths = self.rows_of(r), parameters[:, r][:, own]
            for built in np.unique(lengths, axis=0):
                changed = BenchOverrides(length=tuple(built.tolist()) or None)
                alike = (lengths == built).all(axis=1)
                with np.errstate(invalid="ignore"):  # some may have diverged
                    tip = tip_position(override_mechanism(stated, changed), joints[alike, rows])
                assert tip is not None, "it is compared where there is one"
                out[alike, rows] = tip[..., [0, 2]]
        return out

    def _launch(self, vectors: Array, bench: Array, world_recording: Indices) -> Launch:
        """Return worlds of some numbers, shapes (W, P') and (W, B), at their start."""
        types = self.kernels.types
        numbers, of_world = self._bench_numbers(bench, world_recording)
        return Launch(
            numbers=numbers,
            worlds=struct_of(
                types,
                Worlds,
                mechanism=self.array(of_world.astype(np.int32), wp.int32),
                recording=self.array(world_recording.astype(np.int32), wp.int32),
                parameters=self.array(vectors, types[ParameterVector]),
            ),
            commands=self.commands,
            states=zeros(types, States, len(vectors), device=self.device),
            count=len(vectors),
            device=self.device,
        )

    def _of_chains(self, parameters: Array) -> tuple[Array, Array]:
        """Return what each chain of each recording reads and has of parameters (N, R, P).

        Returns:
            Vectors of the kernels, shape (N R K, P'), and numbers of the bench, (N R K, B), of
            which those of other chains are zero.
        """
        vectors = self.table.kernel_vectors(self._on_bench(parameters), self._chains.count)
        chain = np.array([number.joint for number in self._unknown], dtype=np.intp)
        chain //= self.kernels.structure.joint_count
        everywhere = np.array([not number.bench for number in self._unknown], dtype=bool)
        mine = self._is_own & (everywhere | (chain == np.arange(self._chains.count)[:, None]))
        bench = np.where(mine, parameters[..., None, self.table.bench_columns], 0.0)
        return vectors.reshape(-1, vectors.shape[-1]), bench.reshape(vectors[..., 0].size, -1)

    def _on_bench(self, parameters: Array) -> Array:
        """Return parameters (N, R, P) in the sizes that effects of a line have on this bench."""
        out, first = parameters, self.table.bench_columns.start
        for place, (number, own) in enumerate(zip(self._unknown, self._is_own, strict=True)):
            columns = self.table.columns(number.key)[:1] if own else ()
            for column in columns:
                out = parameters.copy() if out is parameters else out
                out[..., column] *= parameters[..., first + place]
        return out

    def _bench_numbers(self, values: Array, world_recording: Indices) -> tuple[Any, Indices]:
        """Return the bench's numbers with those replaced, (W, B), and which each world has."""
        if not self._is_own.any():
            return self.numbers, world_recording
        arrays = {name: getattr(self.numbers, name).numpy()[world_recording] for name in WRITTEN}
        numbers = [n for n, own in zip(self._unknown, self._is_own, strict=True) if own]
        chain = world_recording % self._chains.count
        parents = self.kernels.structure.parents
        write_by_chain(arrays, numbers, values[:, self._is_own], parents, chain)
        out = self.kernels.types[MechanismNumbers]()
        for name in self.kernels.types[MechanismNumbers].vars:
            source = getattr(self.numbers, name)
            rows = arrays[name] if name in arrays else source.numpy()[world_recording]
            setattr(out, name, self.array(rows, source.dtype))
        return out, np.arange(len(values))

    def _simulate(self, launch: Launch, step: Any, first: Any, readout: Any) -> None:
        """Take all worlds from their start through all rows, and renew their forces on the way."""
        load_kernels(self.kernels.launched, self.device)
        rounds = self.force.rounds([timeline.time for timeline in self.timelines])
        rounds = np.repeat(rounds, self._chains.count, axis=1)
        servos = RolloutServos(self.kernels, launch, rounds[0])
        force = self.force.open(launch.count, self.kernels.structure.tendon_count, self.device)
        force.settle(servos)
        begin, end = (self.array(rounds[0].astype(np.int32), wp.int32) for _ in range(2))
        span = struct_of(self.kernels.types, Rows, begin=begin, end=end, out=first)
        after = np.append(rounds[1:], np.full_like(rounds[:1], NONE_LEFT), axis=0)
        for rows, following in zip(rounds, after, strict=True):
            servos.look_at(rows)
            force.renew(servos)
            begin.assign(np.where(rows < 0, NEVER, rows))
            end.assign(np.where(following < 0, NEVER, following))
            launch.run(self.kernels.rollout, span, step, launch.states, readout)

    def rows_of(self, recording: int) -> slice:
        """Return where a recording's simulated rows stand among all."""
        start = int(self._first[recording])
        return slice(start, start + len(self.timelines[recording].time))

    def trajectories(self, arrays: dict[str, Array]) -> list[list[Trajectory]]:
        """Return what signals of all simulated rows, as `run_rows` gives them, say of each log."""
        return [
            [self._trajectory(arrays, n, r) for r in range(len(self.recordings))]
            for n in range(len(arrays["angle"]))
        ]

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
        commands = types[Commands]()
        counts = self._chains.by_world(
            np.array([len(t.time) for t in self.timelines], dtype=np.int32)
        )
        first = starts_of(counts).astype(np.int32)
        inputs = [row_inputs(r, t) for r, t in zip(self.recordings, self.timelines, strict=True)]
        commands.first = self.array(first, wp.int32)
        commands.count = self.array(counts, wp.int32)
        # Time counts from the recording's first row: float32 would lose microseconds after minutes.
        times = np.concatenate([t.time - t.time[0] for t in self.timelines])
        commands.time = self.array(self._chains.by_row(times), types[real])
        angles = np.concatenate([t.command for t in self.timelines])
        commands.angle = self.array(self._chains.by_row(angles), types[TendonVector])
        voltage, enabled = (
            self._chains.by_row(np.concatenate(each)) for each in zip(*inputs, strict=True)
        )
        commands.voltage = self.array(voltage, types[real])
        commands.enabled = self.array(enabled, types[real])
        if self.driven_by == "path":
            motion = np.concatenate([t.motion for t in self.timelines if t.motion is not None])
            commands.rate = self.array(motion[:, 0], types[real])
            commands.acceleration = self.array(motion[:, 1], types[real])
        settles = NEAR_MEASURED if self.kernels.structure.tendon_count > 1 else FROM_SPRINGS
        known = [start_of(r) for r in self.recordings]
        starts = np.array(
            [settles if k is None else IF_HELD if k.if_held else AS_MEASURED for k in known],
            dtype=np.int32,
        )
        commands.start = self.array(self._chains.by_world(starts), wp.int32)
        begins = [k or first_row(r) for k, r in zip(known, self.recordings, strict=True)]
        angles, rates = (np.stack([getattr(b, name) for b in begins]) for name in ("angle", "rate"))
        commands.start_angle = self.array(self._chains.by_world(angles), types[TendonVector])
        commands.start_rate = self.array(self._chains.by_world(rates), types[TendonVector])
        return commands


def starts_of(counts: Indices) -> Indices:
    """Return where parts of some sizes start that stand one after the other."""
    return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)


def distinct(rows: Array) -> tuple[Indices, Indices]:
    """Return the first of each kind of equal rows, and of which kind each row is."""
    kinds: dict[bytes, int] = {}
    kind = np.array([kinds.setdefault(row.tobytes(), len(kinds)) for row in rows], dtype=np.intp)
    return np.unique(kind, return_index=True)[1], kind


def timeline_of(recording: Recording, stiffness: float, actuator: str) -> Timeline:
    """Return the rows that the simulation of a recording visits."""
    if recording.driven_by == "path":
        return led_timeline(recording)
    timeline = make_timeline(recording, stiffness)
    if find_actuator(actuator).kinematic:
        return without_blocked(timeline, recording)
    return timeline


def row_inputs(recording: Recording, timeline: Timeline) -> tuple[Array, Array]:
    """Return the supply voltage [V] and torque enabled (0 or 1) of the simulated rows, shapes (S,).

    The voltage is 0 where it was not logged, and without the scatter of its register.
    """
    source = np.searchsorted(timeline.measured, np.arange(len(timeline.time)), side="right") - 1
    source = np.maximum(source, 0)  # what is before the first row is as in it
    supply = supply_of(recording)
    voltage = np.zeros(len(recording.time)) if supply is None else supply
    enabled = recording.enabled if recording.command is not None else np.ones(len(recording.time))
    return voltage[source], enabled.astype(np.float64)[source]


def set_servos(worlds: Any, model: Model) -> None:
    """Write what a model states of the servos of all tendons that are wound."""
    own, wound = worlds.tendon, worlds.tendon.direct.numpy() <= 0
    radius, limit = spool_radius_of(model), force_limit_of(model)
    for array, value in ((own.spool_radius, radius), (own.force_limit, limit)):
        if value is not None:
            array.assign(np.where(wound, value, array.numpy()).astype(np.float32))


def release_limits(model: Any) -> None:
    """Let the tendons of a model carry any force, pulling or pushing: it was measured, not made."""
    tendon = model.tendon
    tendon.force_limit.fill_(PUSH_FORCE)
    tendon.direct.fill_(1)


def refuse_drive(mechanism: Mechanism, recordings: Sequence[Recording], actuator: str) -> None:
    """Refuse a mechanism that an actuator cannot move, and recordings that it cannot follow."""
    kind, driven_by = find_actuator(actuator), drive_of(recordings)
    for recording in recordings:
        if recording.tendon_count != len(mechanism.tendons):
            raise InvalidRecording(
                f"{recording.name}: a recording has the servos of its bench; {recording.bench} has "
                f"{len(mechanism.tendons)}, and this one {recording.tendon_count}"
            )
    if kind.kinematic:
        refuse_load(mechanism, recordings, actuator)
    if (driven_by == "path") != kind.leads:
        raise InvalidRecording(
            f"{recordings[0].name}: a path under a load (joint_load, 0 where nothing loads the "
            "joint, without theta_d) and the actuator 'measured_path' go together; it is "
            f"driven by {driven_by}, with {actuator!r}"
        )


def refuse_load(mechanism: Mechanism, recordings: Sequence[Recording], actuator: str) -> None:
    """Refuse a mechanism that an actuator without force cannot move, and recordings of one."""
    if drive_of(recordings) == "force":
        raise InvalidRecording(
            f"{recordings[0].name}: actuator {actuator!r} follows theta_d; the recording has none"
        )
    joints, tendons = mechanism.joints, mechanism.tendons
    if find_actuator(actuator).leads:
        if (len(joints), len(tendons)) != (1, 1) or tendons[0].route is not None:
            raise InvalidModelFile(
                f"actuator {actuator!r} needs a bench with one joint and one tendon of constant "
                f"moment arm; bench {mechanism.name!r} has {len(joints)} and {len(tendons)}"
            )
        return
    if len(joints) != 1 or not all(tendon.direct for tendon in tendons):
        raise InvalidModelFile(
            f"actuator {actuator!r} needs a bench whose servo turns its only joint directly "
            f"(servo, pendulum): it has no force to pull a tendon with; bench {mechanism.name!r} "
            f"has {len(joints)} joints and {len(tendons)} tendons"
        )


def refuse_effects(model: Model, able: Sequence[str]) -> None:
    """Refuse effects of a model that have no place beside an actuator that moves its shaft."""
    for effect in model.effects:
        if effect.name not in able:
            raise InvalidModelFile(
                f"actuator {model.actuator.name!r} has no place for {effect.name!r}; it can hold "
                f"{', '.join(able)}"
            )


def without_blocked(timeline: Timeline, recording: Recording) -> Timeline:
    """Trust no row in which something solid holds the shaft: it tells nothing of its servo."""
    assert recording.command is not None
    theta, goal = recording.motor_position[:, 0], recording.command[:, 0]
    blocked = blocked_rows(theta, goal, 1.0) | blocked_rows(theta, goal, -1.0)
    return replace(timeline, trusted=timeline.trusted & ~blocked)


def drive_of(recordings: Sequence[Recording]) -> DrivenBy:
    """Return what recordings give a simulation.

    Raises:
        InvalidRecording: Some have commands and some do not.
    """
    driven: list[DrivenBy] = [recording.driven_by for recording in recordings]
    if len(set(driven)) > 1:
        other = next(r for r in recordings if r.driven_by != driven[0])
        raise InvalidRecording(
            f"{other.name}: recordings of one rollout are all driven by one signal; this one by "
            f"its {other.driven_by}, {recordings[0].name} by its {driven[0]}"
        )
    return driven[0]


def rollout_groups(recordings: Sequence[Recording]) -> list[tuple[int, ...]]:
    """Divide recordings, by their indices, into those that one rollout may hold."""
    groups: dict[tuple[str, DrivenBy], list[int]] = {}
    for index, recording in enumerate(recordings):
        groups.setdefault((recording.bench, recording.driven_by), []).append(index)
    return [tuple(members) for members in groups.values()]
