"""Measured recordings beside what candidate models make of them: the residuals of every fit."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.bench_overrides import BENCH_OVERRIDE_RANGES, OF_BENCH
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale, Parameter
from tendon_newton.data.recording import Array, Indices, Mask, Recording
from tendon_newton.data.servo_names import name_of
from tendon_newton.device_code.kernel_loading import load_kernels
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.errors import InvalidDataset, unknown_name
from tendon_newton.identification.bench_scale import scale_of
from tendon_newton.identification.cutting import all_segments
from tendon_newton.identification.load_cell import first_reading, reading_stride
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.signals import SIGNALS, Scales, View, compared, finite, noise_of
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of
from tendon_newton.simulation.hosts.rollout import (
    TIME_STEP,
    Candidates,
    Rollout,
    Stepping,
    Trajectory,
    rollout_groups,
)
from tendon_newton.simulation.hosts.timeline import Timeline
from tendon_newton.simulation.model.bench_numbers import (
    OWNER,
    RADIUS,
    BenchNumber,
    line_numbers,
    tolerated_numbers,
    unknown_numbers,
    with_estimates,
    without_estimates,
)
from tendon_newton.simulation.model.chain_copies import are_independent
from tendon_newton.simulation.model.parameter_table import ParameterTable, check_servo

SEED = 0
"""Seed of the noise on forces that drive a mechanism: the same data have the same noise floor."""
DEVICE = "cpu"
"""Also where there is a GPU: a fit has dozens of worlds with 10^4 steps one after the other. A
round of a diagnosis takes 8 s on four cores; on an H200 it took over 200 s, kernels included."""


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Measured minus simulated, for N candidates on one recording."""

    signals: Mapping[str, Array]
    """Name in `SIGNALS` -> what is left of its components [its unit], shape (N, C, T)."""
    trusted: Mask  # Rows whose past is known, shape (T,)

    @property
    def theta(self) -> Array:
        """Motor angle, or the joint's where the motor's is the input [rad], shape (N, T)."""
        return self.signals["theta"][:, 0]

    @property
    def force(self) -> Array | None:
        """Tension [N], shape (N, T); None without a load cell, or where its force is the input."""
        own = self.signals.get("force")
        return None if own is None else own[:, 0]


class Study:
    """A dataset's recordings, ready to be compared with any number of candidate models.

    Args:
        recordings: Recordings of one or several benches, all with as many tendons.
        model: The model to start from.
        effects: Effects that candidates may use, of all servos or of one.
        time_step: Step of the simulation [s].
        in_segments: Whether recordings of mechanisms that forget nothing are cut; see `segments`.
        scale: Scale of the benches, in place of what the recordings show: planned runs show
            nothing.
        tolerant: Whether numbers of benches may differ a little from what is stated.
        like: A study of the same model, whose columns this one shall have.

    Raises:
        InvalidDataset: The recordings have different numbers of tendons, or not their bench's.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        model: Model,
        effects: Sequence[str],
        *,
        time_step: float = TIME_STEP,
        in_segments: bool = False,
        scale: BenchScale | None = None,
        tolerant: bool = False,
        like: Study | None = None,
    ) -> None:
        benches = benches_of(recordings, model)
        self.servos = servo_count(recordings, benches)  # Servos D of every recording
        self.independent = all(are_independent(mechanism) for mechanism in benches.values())
        """Whether each servo moves a finger of its own."""
        self.tolerant = like.tolerant if like is not None else tolerant
        """Whether what is stated may differ by its tolerance."""
        self._model = model = for_servos(model, self.servos, independent=self.independent)
        self.scale = self._scale_of(recordings, benches) if scale is None else scale
        """How large the benches are; ranges, units and floors follow it."""
        if in_segments:
            recordings = all_segments([benches[r.bench] for r in recordings], recordings)
        self.wholes = tuple(without_estimates(r, model) for r in recordings)
        """Recordings as they are simulated, R."""
        self.sources = tuple(
            (i, servo) for i in range(len(self.wholes)) for servo in range(self.servos)
        )
        """Whole recording and servo of each of those that are compared."""
        self.recordings = tuple(of_servo(self.wholes[i], servo) for i, servo in self.sources)
        """Recordings as they are compared: those of one servo after the other, R D."""
        self.time_step = time_step  # Step of its simulations unless another is asked for [s]
        self.unknown = like.unknown if like else unknown_numbers(model, benches, self.wholes)
        """Numbers of benches that the model declares unknown."""
        own = tolerated_numbers(model, benches, self.wholes) if tolerant else ()
        self.tolerated = like.tolerated if like else own
        """Numbers of benches that may differ a little from what is stated."""
        own = line_numbers(model, benches, self.wholes) if tolerant and self.servos == 1 else ()
        self.lines = like.lines if like else own
        """How many times as much of an effect a further bench has as the first."""
        self._bench_numbers = (*self.unknown, *self.tolerated, *self.lines)
        self._groups = self._rollouts(benches, effects)
        self.mechanisms = [benches[self.wholes[own[0]].bench] for _, own in self._groups]
        self.table = replace(self._groups[-1][0].table, scale=self.scale)
        refuse_unknown_tolerances(model, self.table)
        self._vectors = [rollout.base_vectors(model) for rollout, _ in self._groups]
        self.views = tuple(self._view(k, benches) for k in range(len(self.sources)))
        self.compared = tuple(compared(view) for view in self.views)
        """Signals of each of its recordings as measured, name -> components, shape (C, T)."""
        self.noise = self._with_driving_noise(noise_of(self.views))

    def _rollouts(
        self, benches: Mapping[str, Mechanism], effects: Sequence[str]
    ) -> list[tuple[Rollout, tuple[int, ...]]]:
        """Return what simulates the recordings, and which of them each does; kernels are loaded."""
        causes, shared = causes_of(effects, self.servos, independent=self.independent)
        freely = Candidates(effects=causes, shared=shared, unknown=self._bench_numbers)
        groups = []
        for members in rollout_groups(self.wholes):
            rollout = rollout_of(
                benches[self.wholes[members[0]].bench],
                [self.wholes[i] for i in members],
                self._model,
                candidates=freely,
                stepping=Stepping(time_step=self.time_step),
                device=DEVICE,
            )
            groups.append((rollout, members))
        # together, since those of one group may wait for a core while others compile
        sets = [rollout.kernels.launched for rollout, _ in groups]
        load_kernels([kernel for kernels in zip(*sets, strict=True) for kernel in kernels], DEVICE)
        return groups

    def _view(self, index: int, benches: Mapping[str, Mechanism]) -> View:
        """Return one of the recordings that are compared, with its servo and its bench."""
        recording = self.recordings[index]
        bench = benches[recording.bench]
        return View(
            recording=recording,
            mechanism=override_mechanism(bench, recording.bench_overrides),
            servo=self.sources[index][1],
            cell=find_cell(recording, self.timeline(index)),
            draw=self._draw_of(bench),
            gives_way=self.servos == 1 and find_actuator(self._model.actuator.name).gives_way,
        )

    def _draw_of(self, bench: Mechanism) -> float | None:
        """Return the current of an only motor per newton [A/N]; None where the model tells none."""
        actuator = self._model.actuator
        radius = float(actuator.values.get(RADIUS, bench.tendons[0].spool_radius))
        draw = find_actuator(actuator.name).draw(actuator.values, radius)
        return draw if self.servos == 1 else None

    def _scale_of(
        self, recordings: Sequence[Recording], benches: Mapping[str, Mechanism]
    ) -> BenchScale:
        """Return how large the benches are."""
        pairs = [
            (override_mechanism(benches[r.bench], r.bench_overrides), of_servo(r, servo))
            for r in recordings
            for servo in range(self.servos)
        ]
        return scale_of([m for m, _ in pairs], [r for _, r in pairs], self._model)

    def form(self, usual: Scales) -> Scales:
        """Return by how much laws miss all signals, where they miss angles and forces so much."""
        others = {
            name: SIGNALS[name].form(usual, view)
            for own, view in zip(self.compared, self.views, strict=True)
            for name in own.keys() - {"theta", "force"}
        }
        return replace(usual, others=others)

    def timeline(self, index: int) -> Timeline:
        """Return the simulated rows of one of the recordings that are compared."""
        whole, _ = self.sources[index]
        for rollout, members in self._groups:
            if whole in members:
                return rollout.timelines[members.index(whole)]
        raise IndexError(index)

    @property
    def exact(self) -> frozenset[str]:
        """Return the effects that the model says exactly: they are no causes."""
        stated = frozenset(name for name, own in self._model.tolerances.items() if own == 0.0)
        return stated if self._tells_forces() else stated | {"load_cell_gain"}

    def _tells_forces(self) -> bool:
        """Tell whether anything but the cell says how large forces are: else they are in its unit.

        On a path that is led these are a load, a spring or a mass that is known.
        """
        return (
            "mass" not in self._model.fit
            or any(r.driven_by != "path" or np.any(r.joint_load) for r in self.wholes)
            or any(joint.stiffness for m in self.mechanisms for joint in m.joints)
        )

    @property
    def known(self) -> tuple[str, ...]:
        """Causes of the starting model."""
        return tuple(effect.cause for effect in self._model.effects)

    @property
    def kinematic(self) -> bool:
        """Whether positions are all that is computed."""
        return find_actuator(self.table.actuator).kinematic

    @property
    def frees_spools(self) -> bool:
        """Whether spools of some recordings move on their own, behind a rotor."""
        return any(rollout.kernels.structure.free_spool for rollout, _ in self._groups)

    @property
    def takes_commands(self) -> bool:
        """Whether one servo could be told something else: an experiment can be designed."""
        return self.servos == 1 and not self.is_led

    @property
    def is_led(self) -> bool:
        """Whether shafts are where they were measured: no row depends on what others were."""
        return find_actuator(self.table.actuator).leads

    def shows(self, effect: str) -> bool:
        """Tell whether an effect can act in any of the recordings."""
        return any(rollout.shows(effect) for rollout, _ in self._groups)

    def fit_columns(self, model: Model) -> tuple[int, ...]:
        """Return the places of a model's unknown numbers.

        Raises:
            UnknownName: Neither its actuator nor a bench has such a number.
        """
        owners = self.table.owners
        keys = {number.name: number.key for number in (*self.unknown, *self.tolerated)}
        out: list[int] = []
        for name in model.fit:
            found = [
                column
                for column, (owner, parameter) in enumerate(owners)
                if (owner == model.actuator.name and parameter.name == name)
                or (owner == OWNER and keys.get(parameter.name) == name)
            ]
            if not found:
                known = [p.name for owner, p in owners if owner == model.actuator.name]
                of_benches = [key for key in BENCH_OVERRIDE_RANGES if key not in OF_BENCH]
                raise unknown_name("number to fit", name, [*known, RADIUS, *of_benches])
            out += found
        return tuple(out)

    @property
    def tolerated_columns(self) -> tuple[int, ...]:
        """Places of the numbers of benches that may differ a little from what is stated."""
        return self._columns_of(self.tolerated)

    def line_columns(self, effects: Collection[str]) -> tuple[int, ...]:
        """Return the places of what further benches have of some effects."""
        return self._columns_of([number for number in self.lines if number.key in effects])

    def _columns_of(self, numbers: Sequence[BenchNumber]) -> tuple[int, ...]:
        names = {number.name for number in numbers}
        return tuple(
            column
            for column, (owner, parameter) in enumerate(self.table.owners)
            if owner == OWNER and parameter.name in names
        )

    def with_fitted(self, model: Model, values: Mapping[int, float]) -> Model:
        """Return a model with fitted numbers of actuator and benches (column -> value) in place."""
        owners = self.table.owners
        every = (*self.fit_columns(model), *self.tolerated_columns, *self.line_columns(EFFECTS))
        columns = [c for c in every if c in values]
        actuator = {
            owners[c][1].name: values[c] for c in columns if owners[c][0] == model.actuator.name
        }
        bench = {owners[c][1].name: values[c] for c in columns if owners[c][0] == OWNER}
        actuator |= {RADIUS: bench[RADIUS]} if RADIUS in bench else {}
        numbers = [number for number in self._bench_numbers if number.name in bench]
        return replace(
            model,
            actuator=replace(model.actuator, values={**model.actuator.values, **actuator}),
            bench_overrides=with_estimates(model, numbers, bench),
        )

    def parameter(self, column: int) -> Parameter:
        """Return a parameter on these benches; its range holds what the model states of it."""
        owner, parameter = self.table.owners[column]
        states = owner in {self._model.actuator.name, *(e.cause for e in self._model.effects)}
        key = parameter.name if owner == self._model.actuator.name else owner
        if parameter.tolerance > 0.0 and key in self._model.tolerances:
            parameter = replace(parameter, tolerance=self._model.tolerances[key])
        return parameter.holding(self.base_value(column)) if states else parameter

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
                whole recording has its own.
            time_step: Step of the simulation [s] in place of the study's.
        """
        per_recording = values.ndim == 3

        def of_group(group: int) -> dict[int, Residual]:
            (rollout, members), base = self._groups[group], self._vectors[group]
            vectors = np.repeat(base[None], len(values), axis=0)
            for n, row in enumerate(columns):
                for f in np.flatnonzero(row >= 0):
                    vectors[n, :, row[f]] = values[n, members, f] if per_recording else values[n, f]
            own = [k for k, (whole, _) in enumerate(self.sources) if whole in members]
            signals = {SIGNALS[name].rollout(self.recordings[k])
                       for k in own for name in self.compared[k]}  # fmt: skip
            rows = rollout.run_rows(vectors, time_step, tuple(signals))
            return {k: self._compare(k, rollout, members, rows) for k in own}

        # what one group prepares and compares takes place while kernels of another run
        with ThreadPoolExecutor(len(self._groups)) as pool:
            found = list(pool.map(of_group, range(len(self._groups))))
        out = {k: residual for own in found for k, residual in own.items()}
        return [out[k] for k in range(len(self.recordings))]

    def trajectories(self, values: Mapping[int, float]) -> list[Trajectory]:
        """Simulate all whole recordings with some numbers replaced (column -> value)."""
        out: dict[int, Trajectory] = {}
        for (rollout, members), base in zip(self._groups, self._vectors, strict=True):
            vectors = base[None].copy()
            vectors[:, :, list(values)] = list(values.values())
            out.update(zip(members, rollout.run(vectors)[0], strict=True))
        return [out[index] for index in range(len(self.wholes))]

    def _with_driving_noise(self, noise: NoiseFloor) -> NoiseFloor:
        """Add to the encoder's noise what that of the load cell does to a mechanism it drives."""
        if noise.force is None:
            return noise
        squares = [np.zeros(1)]
        rng = np.random.default_rng(SEED)
        for (rollout, _), base in zip(self._groups, self._vectors, strict=True):
            if rollout.driven_by == "force":
                calm = rollout.run_rows(base[None])["angle"]
                rollout.shake(noise.force, rng)
                shaken = rollout.run_rows(base[None])["angle"]
                rollout.shake(0.0, rng)
                squares.append((finite(shaken) - finite(calm)).ravel() ** 2)
        rows = sum(recording.sample_count for recording in self.recordings)
        moved = float(np.concatenate(squares).sum()) / rows
        return replace(noise, theta=float(np.sqrt(noise.theta**2 + moved)))

    def _compare(
        self, index: int, rollout: Rollout, members: Sequence[int], rows: dict[str, Array]
    ) -> Residual:
        place = members.index(self.sources[index][0])
        timeline, span = rollout.timelines[place], rollout.rows_of(place)
        own = {name: values[:, span] for name, values in rows.items()}
        signals = dict[str, Array]()
        for name, measured in self.compared[index].items():
            simulated = SIGNALS[name].simulated(self.views[index], own)[..., timeline.measured]
            signals[name] = SIGNALS[name].residual(measured, simulated, timeline.trusted)
        return Residual(signals=signals, trusted=timeline.trusted)


def refuse_unknown_tolerances(model: Model, table: ParameterTable) -> None:
    """Refuse tolerances of what nothing states.

    Raises:
        UnknownName: A key is neither an effect nor a number of the actuator with a tolerance, nor
            an effect that is exact.
    """
    known = [p.name if owner == model.actuator.name else owner
             for owner, p in table.owners if p.tolerance > 0.0 and owner != OWNER]  # fmt: skip
    for name, tolerance in model.tolerances.items():
        is_exact = tolerance == 0.0 and name in table.effects
        if name not in known and not is_exact:
            raise unknown_name("stated number", name, known)


def benches_of(recordings: Sequence[Recording], model: Model) -> dict[str, Mechanism]:
    """Return the benches of recordings with the numbers that a model states of them."""
    return {bench: bench_of(bench, model) for bench in dict.fromkeys(r.bench for r in recordings)}


def servo_count(recordings: Sequence[Recording], benches: Mapping[str, Mechanism]) -> int:
    """Return how many servos all recordings have.

    Raises:
        InvalidDataset: One has not those of its bench, or they differ: a part would be compared.
    """
    count = recordings[0].tendon_count
    for recording in recordings:
        own, tendons = recording.tendon_count, len(benches[recording.bench].tendons)
        if own != tendons:
            raise InvalidDataset(
                f"{recording.name}: a recording has the servos of its bench; {recording.bench} "
                f"has {tendons}, and this one {own}"
            )
        if own != count:
            raise InvalidDataset(
                f"{recording.name}: recordings to be diagnosed or fitted together have as many "
                f"servos; this one of {recording.bench} has {own}, and {recordings[0].name} of "
                f"{recordings[0].bench} has {count}"
            )
    return count


def for_servos(model: Model, servos: int, *, independent: bool) -> Model:
    """Return a model for benches of so many servos: what is said of an only one is said of all."""
    for effect in model.effects:
        check_servo(effect, servos, independent=independent)
    if servos > 1:
        return model
    return replace(model, effects=tuple(replace(effect, servo=None) for effect in model.effects))


def causes_of(
    effects: Sequence[str], servos: int, *, independent: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what candidates may be made of, and which effects may be of all servos or of one."""
    if servos == 1:
        return tuple(effects), ()
    shared = tuple(
        name for name in effects if find_effect(name).is_of_servo(independent=independent)
    )
    own = [name_of(name, servo) for name in shared for servo in range(servos)]
    return (*effects, *own), shared


def of_servo(recording: Recording, servo: int) -> Recording:
    """Return a recording with the signals of one of its servos alone."""
    if recording.tendon_count == 1:
        return recording
    own = slice(servo, servo + 1)
    signals = {
        name: None if (signal := getattr(recording, name)) is None else signal[:, own]
        for name in ("command", "motor_position", "motor_velocity", "force")
    }
    return replace(recording, name=f"{recording.name}, servo {servo}", **signals)


def replacements(models: Sequence[Mapping[int, float]]) -> tuple[Indices, Array]:
    """Return what `Study.residuals` takes, for candidates given as parameter column -> value."""
    width = max(1, max(len(model) for model in models))
    columns = np.full((len(models), width), -1, dtype=np.intp)
    values = np.zeros((len(models), width))
    for n, model in enumerate(models):
        columns[n, : len(model)] = list(model.keys())
        values[n, : len(model)] = list(model.values())
    return columns, values


def find_cell(recording: Recording, timeline: Timeline) -> tuple[int, int] | None:
    """Return (first row read, rows per reading) of a slow load cell, None for a fast one."""
    if recording.force is None or recording.load_cell_rate is None:
        return None
    stride = reading_stride(recording.load_cell_rate, timeline.time)
    if stride <= 1:
        return None
    return first_reading(recording.force[:, 0], timeline.measured, stride), stride
