"""Recordings replayed by Newton's SolverMuJoCo: the reference, and the way to contacts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from tendon_newton.actuators import find_actuator
from tendon_newton.actuators.networks.history import History
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.placeholders import MemoryVector, ParameterVector, TendonVector
from tendon_newton.device_code.structs import (
    NewtonJoints,
    Readout,
    StateRows,
    States,
    Track,
    Worlds,
)
from tendon_newton.device_code.templates import Bindings
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.launch import Launch
from tendon_newton.simulation.hosts.replay import bench_of, rollout_of
from tendon_newton.simulation.hosts.rollout import SIGNALS, Stepping, Trajectory
from tendon_newton.simulation.hosts.rollout_servos import RolloutServos
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.kernel_arrays import samples_of, struct_of, zeros
from tendon_newton.simulation.model.mechanism_arrays import joint_places, write_joints
from tendon_newton.simulation.model.stage_fields import LOG_STAGES, refuse_stages
from tendon_newton.simulation.model.structure import Structure
from tendon_newton.simulation.mujoco import mujoco_kernels

# Default step [s]: the tendon's force is explicit here, and stiff friction must be met with short
# steps
MUJOCO_STEP = 5.0e-4
# MuJoCo's `solimp` of joint friction with which a joint creeps least; its default lets a joint
# slide to the end
STICKING_FRICTION = (0.9999, 0.99999, 1.0e-4, 0.5, 2.0)
UNSUPPORTED = (*LOG_STAGES, Stage.SPEED, Stage.INERTIA, Stage.TILT, Stage.JOINT_FRICTION)


class MujocoRollout:
    """One world per recording, stepped by SolverMuJoCo on a grid of its own.

    Rows are read between the grid's instants.

    The tendon's force comes from the same stages as in `Rollout`, as `control.joint_f` at the
    start of each substep. Dry friction of a
    tendon is smoothed (`mujoco_kernels.SLIDING_SPEED`); joint friction and end stops are MuJoCo's
    own, from the asset's numbers. A rotor is the tendon's armature: its spool never moves on its
    own, so that a slack string shows as no tension, and not in the angle.

    The step [s] is shortened so that the instants of a force network fall on its grid. The network
    runs as ``torchscript`` or ``fused``.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        model: Model,
        *,
        time_step: float = MUJOCO_STEP,
        network: str = "torchscript",
        trust: bool = False,
        device: Any = None,
    ) -> None:
        mechanism.refuse_moving_obstacle("MujocoRollout")
        effects = [effect.name for effect in model.effects]
        refuse_stages(effects, UNSUPPORTED, "SolverMuJoCo")
        if find_actuator(model.actuator.name).leads:
            raise InvalidParameter(
                f"SolverMuJoCo moves masses by forces; {model.actuator.name!r} leads a shaft along "
                "a path, which the solver 'tendon' can"
            )
        self._rollout = rollout_of(
            mechanism,
            recordings,
            model,
            network=network,
            trust=trust,
            stepping=Stepping(time_step=time_step, free_spools=False),
            device=device,
        )
        self._holds_force = self._rollout.kernels.structure.holds_force
        period = self._rollout.force.period or 2.0 * time_step
        self._pairs_per_query = max(1, int(np.ceil(period / (2.0 * time_step) - 1.0e-6)))
        self._time_step = period / (2.0 * self._pairs_per_query)
        self._worlds = len(recordings)
        self._types = self._rollout.kernels.types
        self._kernel_of = mujoco_kernel_set(self._rollout.kernels.structure)
        vectors = self._rollout.base_vectors(model)
        self._parameters = self._rollout.array(vectors, self._types[ParameterVector])
        overrides = [recording.bench_overrides for recording in recordings]
        self._model: Any = build_model(mechanism, self._worlds, overrides=overrides, device=device)
        self._add_rotor(vectors)
        self._add_damper(vectors)
        self._contacts = MujocoContacts(self._model)
        self._solver = solver_with_contacts(self._model)
        self._places = joint_places(self._model)
        self._world_index = self._rollout.array(np.arange(self._worlds, dtype=np.int32), wp.int32)

    def run(self) -> list[Trajectory]:
        """Simulate all recordings.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        ends = [timeline.time[-1] - timeline.time[0] for timeline in self._rollout.timelines]
        pairs = int(np.ceil(max(ends) / self._time_step)) // 2 + 2
        track = self._make_track(2 * pairs)
        states = [self._model.state(), self._model.state()]
        control = self._model.control()
        force, structure = self._rollout.force, self._rollout.kernels.structure
        force = force.open(self._worlds, structure.tendon_count, self._model.device)
        launch = self._launch(track)
        first = RolloutServos(self._rollout.kernels, launch, np.zeros(self._worlds, dtype=np.int64))
        force.settle(first)
        self._place(states[0], launch.states)
        joints = self._joints_of(states[0])
        servos = TrackServos(launch, self._types, self._kernel_of["sense"], track, joints, first)
        force.renew(servos)
        self._step_twice(states, control, track)  # compiles and allocates before the capture
        with wp.ScopedCapture(device=self._model.device) as capture:
            self._step_twice(states, control, track)
        graph: Any = capture.graph
        for pair in range(1, pairs):
            if pair % self._pairs_per_query == 0:
                force.renew(servos)
            wp.capture_launch(graph)
        return self._read_rows(track)

    def _joints_of(self, state: Any) -> Any:
        """Return the joints in a state of Newton's."""
        return struct_of(self._types, NewtonJoints, position=state.joint_q, velocity=state.joint_qd)

    def _step_twice(self, states: list[newton.State], control: newton.Control, track: Any) -> None:
        """Step there and back between two states, so that a graph may repeat it."""
        for before, after in (states, states[::-1]):
            common = [self._rollout.numbers, self._rollout.commands, track]
            inputs = [*common, self._joints_of(before), control.joint_f]
            wp.launch(self._kernel_of["push"], self._worlds, inputs, device=self._model.device)
            found = self._contacts.find(before)
            self._solver.step(before, after, control, found, self._time_step)

    def _add_rotor(self, vectors: Any) -> None:
        """Let the joints feel the rotors' inertia, and dry friction as hard as MuJoCo can."""
        friction: Any = self._model.mujoco.solimpfriction
        friction.assign(np.tile(STICKING_FRICTION, (len(friction), 1)).astype(np.float32))
        table = self._rollout.table
        if any(p.name == "armature" for _, p in table.owners):
            radius = self._model.tendon.spool_radius.numpy()
            rotor = np.repeat(
                vectors[:, table.column(table.actuator, "armature")], len(radius) // self._worlds
            )
            self._model.mujoco.tendon_armature.assign((rotor / radius**2).astype(np.float32))

    def _add_damper(self, vectors: Any) -> None:
        """Let MuJoCo damp the tendons by what a network's force answers to their speed.

        The finger's light end would need steps of 0.04 ms if this were explicit.
        """
        if self._holds_force:
            table = self._rollout.table
            radius = self._model.tendon.spool_radius.numpy()
            damping, scale = (
                vectors[:, table.column(table.actuator, name)]
                for name in ("hold_damping", "force_scale")
            )
            damping = np.repeat(scale * damping, len(radius) // self._worlds)
            self._model.mujoco.tendon_damping.assign((damping / radius).astype(np.float32))

    def _place(self, state: Any, states: Any) -> None:
        """Put every world where its recording starts."""
        write_joints(state.joint_q, self._places[0], states.q)
        write_joints(state.joint_qd, self._places[1], states.v)
        newton.eval_fk(self._model, state.joint_q, state.joint_qd, state)

    def _make_track(self, length: int) -> Any:
        """Allocate room for the state at the start of every substep."""
        types, device, worlds = self._types, self._model.device, self._worlds
        rows = zeros(types, StateRows, length, worlds, device=device)
        return struct_of(
            types,
            Track,
            parameters=self._parameters,
            position_index=self._places[0],
            velocity_index=self._places[1],
            time_step=self._time_step,
            q=rows.q,
            v=rows.v,
            memory=rows.memory,
            latest=wp.zeros(worlds, dtype=types[MemoryVector], device=device),
            command=wp.zeros(worlds, dtype=types[TendonVector], device=device),
            row=wp.zeros(worlds, dtype=wp.int32, device=device),
            count=wp.zeros(worlds, dtype=wp.int32, device=device),
        )

    def _launch(self, track: Any) -> Launch:
        """Return the worlds as a rollout takes them; their memories are the track's latest."""
        index, types = self._world_index, self._types
        states = zeros(types, States, self._worlds, device=self._model.device)
        states.memory = track.latest
        return Launch(
            numbers=self._rollout.numbers,
            worlds=struct_of(
                types, Worlds, mechanism=index, recording=index, parameters=self._parameters
            ),
            states=states,
            commands=self._rollout.commands,
            count=self._worlds,
            device=self._model.device,
        )

    def _read_rows(self, track: Any) -> list[Trajectory]:
        rollout, types = self._rollout, self._types
        counts = [len(timeline.time) for timeline in rollout.timelines]
        row_world: Any = np.repeat(np.arange(self._worlds, dtype=np.int32), counts)
        worlds = rollout.array(row_world, wp.int32)
        readout = zeros(types, Readout, sum(counts), device=self._model.device)
        inputs = [rollout.numbers, rollout.commands, track, worlds, readout]
        wp.launch(self._kernel_of["read"], sum(counts), inputs, device=self._model.device)
        arrays = {name: getattr(readout, own).numpy()[None] for name, own in SIGNALS.items()}
        if not np.isfinite(arrays["joints"]).all():
            raise SimulationDiverged(
                f"SolverMuJoCo must stay finite; it did not at steps of {self._time_step} s"
            )
        return rollout.trajectories(arrays)[0]


def replay_in_mujoco(
    recordings: Sequence[Recording],
    model: Model,
    *,
    time_step: float = MUJOCO_STEP,
    network: str = "torchscript",
    trust: bool = False,
) -> list[Trajectory]:
    """Simulate recordings as `replay` does, with the same tendons and most of the effects."""
    out: dict[int, Trajectory] = {}
    for bench in dict.fromkeys(r.bench for r in recordings):
        members = [i for i, r in enumerate(recordings) if r.bench == bench]
        own = [recordings[i] for i in members]
        rollout = MujocoRollout(
            bench_of(bench, model), own, model, time_step=time_step, network=network, trust=trust
        )
        out.update(zip(members, rollout.run(), strict=True))
    return [out[index] for index in range(len(recordings))]


@dataclass(frozen=True)
class TrackServos:
    """The servos of worlds that MuJoCo steps, as a source of forces sees them."""

    launch: Launch  # The worlds
    types: Bindings  # What the kernels' declarations stand for
    kernel: wp.Kernel  # Shows what their servos do
    track: Any  # Where they have been, a `Track` struct
    joints: Any  # Where they are, a `NewtonJoints` struct
    first: RolloutServos  # Servos where their recordings start

    def sense(self, samples: History, *, fill: bool = False) -> None:
        """Add what each servo does at the start of the substep to come to its history."""
        assert not fill, "what fills a history is the start of a recording"
        own = self.launch
        seen = samples_of(self.types, samples)
        inputs = [own.numbers, own.commands, self.track, self.joints, seen]
        wp.launch(self.kernel, own.count, inputs, device=own.device)

    def hold(self, force: wp.array) -> None:
        """Hold forces [N], shape (W, D), from now on."""
        self.first.hold(force)


@cache
def mujoco_kernel_set(structure: Structure) -> dict[str, wp.Kernel]:
    """Return the kernels by what they do."""
    assembly = assemble(structure)
    return {
        "push": assembly.kernel(mujoco_kernels.push_kernel),
        "read": assembly.kernel(mujoco_kernels.track_reading_kernel),
        "sense": assembly.kernel(mujoco_kernels.track_sense_kernel),
    }


# Newton's ``solref_mode`` in which stiffness and damping of a shape are [N/m] and [N s/m]
FORCE_SPACE = 0
# MuJoCo's `solimp` with which a contact is a spring and a damper also in motion; by its default it
# gives way as if the link were as heavy as a body, and lets light links pass
SOFTNESS = (0.01, 0.01, 1.0e-3, 0.5, 2.0)
SLIP_RATIO = 1.0e4  # MuJoCo's ``impratio`` [1]: how much less friction creeps than a contact gives


class MujocoContacts:
    """Contacts of a model's links with its obstacles; none where it has no obstacles.

    Newton's stiffness per shape is that of ours. Damping is linear, as much as ours at a
    newton (`obstacle_shapes.USUAL_FORCE`). By MuJoCo's priorities one material of two counts: that
    of an obstacle before that of a link which is one, and that before another link's.
    """

    def __init__(self, model: Any) -> None:
        self._found: Any = None
        self._pipeline: Any = None
        if not hasattr(model.tendon, "obstacle_shape"):
            return
        own = model.mujoco
        modes, ranks, given = (
            array.numpy() for array in (own.solref_mode, own.geom_priority, own.geom_solimp)
        )
        shapes = [model.tendon.obstacle_shape.numpy(), model.tendon.bone_shape.numpy()]
        modes[np.concatenate(shapes)] = FORCE_SPACE
        count = len(shapes[0]) // model.world_count
        order = count - np.arange(len(shapes[0])) % count  # the first counts between two links
        ranks[shapes[0]] = np.where(np.isin(shapes[0], shapes[1]), order, count + 1)
        given[shapes[0]] = SOFTNESS
        own.solref_mode.assign(modes)
        own.geom_priority.assign(ranks)
        own.geom_solimp.assign(given)
        self._pipeline = newton.CollisionPipeline(model)
        self._found = self._pipeline.contacts()

    def find(self, state: newton.State) -> newton.Contacts | None:
        """Return the contacts of a state; the same object every time."""
        if self._pipeline is not None:
            self._pipeline.collide(state, self._found)
        return self._found


def solver_with_contacts(model: Any) -> SolverMuJoCo:
    """Return a solver for a model, which takes contacts where it has obstacles."""
    if not hasattr(model.tendon, "obstacle_shape"):
        return SolverMuJoCo(model, disable_contacts=True)
    return SolverMuJoCo(model, use_mujoco_contacts=False, cone="elliptic", impratio=SLIP_RATIO)
