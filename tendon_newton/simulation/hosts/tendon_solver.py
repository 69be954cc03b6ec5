"""Our solver behind Newton's interface.

A control step of tendon-driven mechanisms in one kernel launch.
"""

from collections.abc import Sequence
from functools import cache, partial
from math import ceil
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverBase

from tendon_newton.actuators import find_actuator
from tendon_newton.actuators.networks.history import History
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.device_code.kernel_loading import load_kernels
from tendon_newton.device_code.placeholders import (
    ParameterVector,
    Quaternion,
    TendonVector,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import (
    Commands,
    Mechanism,
    NewtonJoints,
    Servo,
    States,
    Worlds,
)
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidParameter, unknown_name
from tendon_newton.simulation.dynamics.settling import settle_kernel
from tendon_newton.simulation.hosts.rollout import set_servos
from tendon_newton.simulation.kernels import body_kernels, control_kernels
from tendon_newton.simulation.model.assembly import Assembly, assemble
from tendon_newton.simulation.model.chain_copies import copies_of, gather_kernel, spread_kernel
from tendon_newton.simulation.model.kernel_arrays import samples_of, struct_of, zeros
from tendon_newton.simulation.model.mechanism_arrays import (
    body_places,
    fill_mechanism,
    joint_places,
    plane_of,
    read_topology,
    spools_are_free,
)
from tendon_newton.simulation.model.parameter_table import table_of
from tendon_newton.simulation.model.stage_fields import LOG_STAGES, refuse_stages
from tendon_newton.simulation.model.structure import Precision, Structure

# Default of `max_step` [s]: a policy's simulation, an eighth of an encoder's count off, as
# tests/physics/test_accuracy.py measures
LONGEST_STEP = 5.0e-4
# Control steps for which past commands are kept; a `command_delay` may not be longer
HISTORY = 64
# Worlds of a CUDA block in a step, and blocks that a multiprocessor has room for: 128 registers a
# thread, with some kept in memory, are a fifth faster than the compiler's own 213 and half as many
# threads, on one H200
BLOCK = (128, 4)
# Worlds and blocks with a free body, whose kernel keeps 20 KB of a world in memory. With 255
# registers and small blocks, which spread over all multiprocessors, `hand_ball` makes 24,200
# control steps a second in place of 14,100 (one H200, 8,192 worlds).
BODY_BLOCK = (32, 8)


class TendonSolver(SolverBase):
    """Steps Newton's `State` in joint coordinates, with an asset's tendons and a model's effects.

    The motor commands are not part of Newton's `Control`: write `command`, shape (W, D), before
    each step. It holds for the whole step, as a servo holds its goal between two packets; `dt` is
    the control step, which one kernel divides into substeps no longer than `max_step`. Links meet
    the obstacles of their mechanism (`contacts`), and nothing else; `control.joint_f` is not read.
    An obstacle with a mass moves: its free joint is a part of the state.

    A mechanism of K equal chains that share neither joint nor tendon, such as a hand, is stepped as
    K mechanisms of one chain: numbers that are one per world stand once for each chain.

    Numbers per world may change at any time: those of the actuator and the effects in `parameters`,
    all others in the arrays of the Newton model, followed by `notify_model_changed`. No step
    allocates, so that steps can be captured in a graph.

    Args:
        model: Worlds of one mechanism, from `mechanisms.worlds.build_model`.
        description: Actuator and effects.
        max_step: Longest substep [s].
        precision: Scalar inside the kernels; Newton's arrays are float32.
        effects: Further effects at null, whose numbers may be set later.
        update_bodies: Whether a step also writes `body_q` and `body_qd`, which viewers show.
    """

    def __init__(
        self,
        model: newton.Model,
        description: Model,
        *,
        max_step: float = LONGEST_STEP,
        precision: Precision = "float64",
        effects: Sequence[str] = (),
        update_bodies: bool = True,
    ) -> None:
        super().__init__(model)
        if not max_step > 0.0:
            raise InvalidParameter(f"max_step must be positive; it is {max_step} s")
        if find_actuator(description.actuator.name).kinematic:
            raise InvalidParameter(
                f"TendonSolver needs an actuator with a force; {description.actuator.name!r} "
                "gives a position: replay its recordings with Rollout"
            )
        causes = (*effects, *(effect.cause for effect in description.effects))
        whole = read_topology(model)
        copies = copies_of(model)
        topology, self.chain_count = copies.topology, copies.count
        """Equal chains K of each world; kernels see W K worlds of one."""
        of_world = table_of(
            description.actuator.name, causes, whole.tendon_count,
            independent=copies.independent,
        )  # fmt: skip
        self.table = of_world.of_chain(self.chain_count)
        """Where the numbers of a chain stand."""
        refuse_stages(self.table.effects, LOG_STAGES, "TendonSolver")
        self.max_step = max_step
        self.update_bodies = update_bodies
        set_servos(model, description)
        self._code, self._kernel_of = control_kernel_set(
            Structure(
                **vars(topology),
                actuator=self.table.actuator,
                effects=self.table.effects,
                by_servo=self.table.by_servo,
                planar=plane_of(model, whole) is not None,
                precision=precision,
                free_spool=spools_are_free(model, self.table.actuator),
            )
        )
        self._mechanism = fill_mechanism(model, self._code)
        self.moves_body = topology.touch.moves
        """Whether an obstacle is free to move."""
        self._history_length = HISTORY if self._code.structure.uses(Stage.CLOCK) else 1
        vectors = of_world.kernel_vectors(of_world.vector(description), self.chain_count)
        self._make_arrays(np.tile(vectors, (self.world_count, 1)))

    @property
    def world_count(self) -> int:
        """Number of worlds W."""
        return int(self.model.world_count)

    @property
    def tendon_count(self) -> int:
        """Number of tendons D of each world."""
        return self.chain_count * self._code.structure.tendon_count

    @property
    def joint_count(self) -> int:
        """Number of joints J of each world."""
        return self.chain_count * self._code.structure.joint_count

    @property
    def holds_force(self) -> bool:
        """Whether the actuator's force is decided outside; see `hold`."""
        return self._code.structure.holds_force

    def load(self) -> None:
        """Compile at once what resets, steps and readings launch; else each does when launched."""
        seldom = {"contact"} if self.holds_force else {"contact", "sense", "hold"}
        usual = sorted(self._kernel_of.keys() - seldom, key=lambda name: name != "step")
        load_kernels([self._kernel_of[name] for name in usual], self.model.device)

    def _make_arrays(self, vectors: Array) -> None:
        """Allocate all that a step reads and writes; the chains' numbers have shape (W K, P)."""
        worlds, tendons = self.world_count, self.tendon_count
        types, device = self._code.types, self.model.device
        self.command = wp.zeros((worlds, tendons), dtype=wp.float32, device=device)
        """Motor angles asked for [rad], shape (W, D)."""
        self.parameters = self._array(vectors, types[ParameterVector])
        """Numbers of actuator and effects, shape (W K, P); `table` says where each stands."""
        self.motor_position = wp.zeros_like(self.command)
        """What the encoder reports [rad], shape (W, D); see `read_sensors`."""
        self.motor_velocity = wp.zeros_like(self.command)
        """Rate of the motor angle [rad/s], shape (W, D)."""
        self.force = wp.zeros_like(self.command)
        """Tension at the load cell [N], shape (W, D)."""
        self.everywhere = wp.ones(worlds, dtype=wp.bool, device=device)
        """A mask of all worlds, shape (W,)."""
        touch = self._code.structure.touch
        shape = (worlds, self.chain_count * len(touch.links), len(touch.shapes))
        self.contact_force = wp.zeros(shape, dtype=wp.vec3f, device=device)
        """What obstacles do to links [N], in the axes of the base, shape (W, C, O), capsule by
        capsule and obstacle by obstacle; see `read_contacts`."""
        self._marked = wp.zeros(self._chains, dtype=wp.bool, device=device)
        self._servo = self._make_servo()
        self._history = self._make_history()
        self._good = [wp.clone(self._servo.q), wp.clone(self._servo.memory)]
        if self.moves_body:
            self._carry_bodies(self.model, self.everywhere)
            self._good_bodies = [
                wp.clone(a) for a in (self._servo.body_place, self._servo.body_turn)
            ]

    def _make_servo(self) -> Any:
        """Allocate what each world keeps between control steps."""
        types, device, worlds = self._code.types, self.model.device, self._chains
        self.voltage = wp.zeros(worlds, dtype=wp.float32, device=device)
        """Supply of each chain [V]; 0 stands for the actuator's own, shape (W K,)."""
        self.enabled = wp.ones(worlds, dtype=wp.float32, device=device)
        """Whether each chain's servos give torque (1) or hang loose (0), shape (W K,)."""
        position, velocity = map(self._by_chain, joint_places(self.model))
        states = zeros(types, States, worlds, device=device)
        return struct_of(
            types,
            Servo,
            parameters=self.parameters,
            time=wp.zeros(worlds, dtype=types[real], device=device),
            q=states.q,
            v=states.v,
            memory=states.memory,
            voltage=self.voltage,
            enabled=self.enabled,
            command=self._by_chain(self.command),
            position_index=position,
            velocity_index=velocity,
            **self._make_bodies(),
        )

    def _make_bodies(self) -> dict[str, Any]:
        """Allocate what each world keeps of its free body, where it has one."""
        if not self.moves_body:
            return {}
        types, device, worlds = self._code.types, self.model.device, self.world_count
        position, velocity = body_places(self.model)
        bodies = {
            "body_place": wp.zeros(worlds, dtype=types[Vec3], device=device),
            "body_turn": wp.zeros(worlds, dtype=types[Quaternion], device=device),
            "body_position_index": position,
            "body_velocity_index": velocity,
        }
        if self.chain_count > 1:
            bodies["body_push"] = wp.zeros((self._chains, 2), dtype=types[Vec3], device=device)
        return bodies

    def _carry_bodies(self, state: Any, chosen: wp.array) -> None:
        """Put free bodies where a state has them in the chosen worlds, shape (W,)."""
        if self.moves_body:
            inputs = [self._mechanism, self._servo, chosen, self._joints_of(state)]
            self._launch("carry", self.world_count, inputs)

    def _make_history(self) -> Any:
        """Allocate the past commands of each world, as a recording of a few rows."""
        types, device = self._code.types, self.model.device
        length, worlds = self._history_length, self._chains
        first = (np.arange(worlds) * length).astype(np.int32)
        rows = worlds * length
        return struct_of(
            types,
            Commands,
            first=wp.array(first, dtype=wp.int32, device=device),
            count=wp.full(worlds, length, dtype=wp.int32, device=device),
            time=self._array(np.tile(np.arange(-length, 0.0), worlds), types[real]),
            angle=wp.zeros(rows, dtype=types[TendonVector], device=device),
            voltage=wp.zeros(rows, dtype=types[real], device=device),
            enabled=wp.ones(rows, dtype=types[real], device=device),
            start=wp.zeros(worlds, dtype=wp.int32, device=device),
            start_angle=wp.zeros(worlds, dtype=types[TendonVector], device=device),
            start_rate=wp.zeros(worlds, dtype=types[TendonVector], device=device),
        )

    def reset(
        self,
        state: newton.State,
        world_mask: wp.array | None = None,
        flags: newton.StateFlags | int | None = None,
    ) -> None:
        """Begin anew: time 0, only the present `command` ever given, every internal state relaxed.

        Args:
            state: Where the worlds start; its joint coordinates stay as they are.
            world_mask: Worlds to reset, shape (W + 1,) as for every Newton solver; all by default.
            flags: Not needed.
        """
        self.begin(state, self._chosen(world_mask), at_rest=False)

    def settle(self, state: newton.State, world_mask: wp.array | None = None) -> None:
        """Put worlds at rest in the friction-free equilibrium of their `command`.

        Where a recording starts. Under a force that is held, its equilibrium. The mask has the
        shape (W + 1,); all by default. The state gets their joint coordinates.
        """
        self.begin(state, self._chosen(world_mask), at_rest=True)

    def begin(self, state: newton.State, chosen: wp.array, *, at_rest: bool) -> None:
        """Reset or settle the chosen worlds, shape (W,)."""
        self._carry_bodies(state, chosen)
        inputs = [*self._inputs(), self._spread(chosen), self._joints_of(state)]
        self._launch("forget", self._chains, inputs)
        if at_rest:
            self.relax(state, chosen)
        self._carry_bodies(state, chosen)

    def relax(self, state: newton.State, chosen: wp.array) -> None:
        """Move the chosen worlds, shape (W,), to the equilibrium of their command or held force."""
        servo, types, device = self._servo, self._code.types, self.model.device
        chains = wp.array(np.flatnonzero(self._spread(chosen).numpy()), dtype=int, device=device)
        if not chains.size:
            return
        parameters = wp.clone(self.parameters[chains])
        worlds = struct_of(types, Worlds, mechanism=chains, recording=chains, parameters=parameters)
        copies = {name: wp.clone(getattr(servo, name)[chains]) for name in ("q", "v", "memory")}
        states = struct_of(types, States, **copies)
        inputs = [0, self._mechanism, worlds, self._history, states]
        self._launch("settle", chains.size, inputs)
        self._launch("adopt", chains.size, [servo, chains, states, self._joints_of(state)])
        self._place_bodies(state)

    def sense(
        self, state: newton.State, samples: History, chosen: wp.array, *, fill: bool = False
    ) -> None:
        """Add what force networks are shown of the chosen worlds, shape (W,), to their history.

        The history is that of all W D servos; to fill is to let the sample stand for all the past.
        """
        given = [self._spread(chosen), int(fill), self._joints_of(state)]
        seen = samples_of(self._code.types, samples)
        self._launch("sense", self._chains, [*self._inputs(), *given, seen])

    def hold(self, force: wp.array, chosen: wp.array) -> None:
        """Hold forces [N], shape (W, D), at the spools of the chosen worlds, shape (W,).

        For an actuator whose force is decided outside; they stay until the next call.
        """
        inputs = [self._mechanism, self._servo, self._spread(chosen), self._by_chain(force)]
        self._launch("hold", self._chains, inputs)

    def guard(self, state: newton.State, diverged: wp.array) -> None:
        """Mark worlds, shape (W,), that left every physical range in the last step.

        They are put back to where they last were, at rest, and do no harm to others.
        """
        marks = diverged if self.chain_count == 1 else self._marked
        joints = self._joints_of(state)
        self._launch("guard", self._chains, [self._servo, *self._good, joints, marks])
        if self.chain_count > 1:
            inputs = [self.chain_count, marks, diverged]
            wp.launch(gather_kernel, self._chains, inputs=inputs, device=self.model.device)
        if self.moves_body:
            inputs = [self._servo, *self._good_bodies, joints, diverged]
            self._launch("guard_body", self.world_count, inputs)

    def bench_numbers(self, name: str) -> wp.array:
        """Return an array of the mechanism that every step reads, one row per world and chain.

        Such as ``mass`` [kg], ``stiffness`` [N m/rad], ``spool_radius`` [m] or ``arms`` [m]. What
        is written there counts from the next step on, until `notify_model_changed` reads the
        Newton model again.

        Raises:
            UnknownName: No such array.
        """
        names = self._code.types[Mechanism].vars
        if name not in names:
            raise unknown_name("bench number", name, names)
        return getattr(self._mechanism, name)

    @property
    def _chains(self) -> int:
        """Chains of all worlds, W K."""
        return self.world_count * self.chain_count

    def _by_chain(self, array: wp.array) -> wp.array:
        """Return numbers of worlds, shape (W, N), as those of their chains, (W K, N / K)."""
        return array.reshape((self._chains, array.shape[1] // self.chain_count))

    def _spread(self, chosen: wp.array) -> wp.array:
        """Return a mask of worlds, shape (W,), as one of their chains."""
        if self.chain_count == 1:
            return chosen
        spread = wp.zeros(self._chains, dtype=wp.bool, device=self.model.device)
        inputs = [self.chain_count, chosen]
        wp.launch(spread_kernel, self._chains, inputs, [spread], device=self.model.device)
        return spread

    def _chosen(self, world_mask: wp.array | None) -> wp.array:
        mask = self._normalize_reset_world_mask(world_mask)
        return self.everywhere if mask is None else mask

    def _place_bodies(self, state: Any) -> None:
        """Let the bodies follow the joints, for viewers."""
        if self.update_bodies:
            newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)

    def step(
        self,
        state_in: newton.State,
        state_out: newton.State,
        control: newton.Control | None,
        contacts: newton.Contacts | None,
        dt: float,
        *,
        observables: SolverBase.Observables | None = None,
    ) -> None:
        """Hold `command` for one control step.

        Args:
            state_in: Where the step starts; `joint_q` and `joint_qd` are read.
            state_out: Where it ends; may be the same object.
            control: Not read.
            contacts: Must be None.
            dt: Control step [s].
            observables: Must be None.
        """
        if contacts is not None or observables is not None:
            raise InvalidParameter(
                "TendonSolver finds contacts with obstacles itself and offers no observables; "
                "pass None, or use SolverMuJoCo"
            )
        substeps = max(1, ceil(dt / self.max_step - 1.0e-6))
        states = [self._joints_of(state_in), self._joints_of(state_out)]
        inputs = [*self._inputs(), substeps, dt / substeps, *states]
        threads = self.world_count if self.moves_body else self._chains
        self._launch("step", threads, inputs, block_dim=step_block(self._code.structure)[0])
        self._place_bodies(state_out)

    def read_sensors(self, state: newton.State) -> None:
        """Write what the sensors report to `motor_position`, `motor_velocity` and `force`.

        The readings are those just after the present `command` was given.
        """
        sensors = (self.motor_position, self.motor_velocity, self.force)
        readings = map(self._by_chain, sensors)
        self._launch("read", self._chains, [*self._inputs(), self._joints_of(state), *readings])

    def read_contacts(self, state: newton.State) -> None:
        """Write what obstacles do to links to `contact_force`."""
        self.contact_force.zero_()
        if "contact" in self._kernel_of:
            self._carry_bodies(state, self.everywhere)
            _, capsules, obstacles = self.contact_force.shape
            shape = (self._chains, capsules // self.chain_count, obstacles)
            given = [self._mechanism, self._servo, self._joints_of(state)]
            self._launch("contact", self._chains, [*given, self.contact_force.reshape(shape)])

    def notify_model_changed(self, flags: newton.ModelFlags | int) -> None:
        """Read the numbers of the model again, in place."""
        if flags:
            fresh = fill_mechanism(self.model, self._code)
            for name in self._code.types[Mechanism].vars:
                getattr(self._mechanism, name).assign(getattr(fresh, name))
            self._carry_bodies(self.model, wp.zeros_like(self.everywhere))

    def _launch(self, name: str, threads: int, inputs: list[Any], **options: Any) -> None:
        """Launch a kernel."""
        wp.launch(self._kernel_of[name], threads, inputs, device=self.model.device, **options)

    def _inputs(self) -> list[Any]:
        """Return what most kernels read first."""
        return [self._mechanism, self._servo, self._history]

    def _joints_of(self, state: Any) -> Any:
        """Return the joints in a state of Newton's."""
        types = self._code.types
        return struct_of(types, NewtonJoints, position=state.joint_q, velocity=state.joint_qd)

    def _array(self, values: Array, dtype: Any) -> Any:
        scalar = np.dtype(self._code.structure.precision)
        return wp.array(values.astype(scalar), dtype=dtype, device=self.model.device)


def step_block(structure: Structure) -> tuple[int, int]:
    """Return the threads of a CUDA block in a step, and the blocks of a multiprocessor."""
    return BODY_BLOCK if structure.touch.moves else BLOCK


@cache
def control_kernel_set(structure: Structure) -> tuple[Assembly, dict[str, wp.Kernel]]:
    """Return the code of a solver and its kernels by what they do."""
    assembly = assemble(structure)
    kernel = partial(assembly.kernel, portable=True)
    # first, as in a `KernelSet`: the name of a kernel counts what was bound before
    settle = kernel(settle_kernel)
    touch, step = structure.touch, control_kernels.control_step_kernel
    further = {}
    if touch.contacts:
        further["contact"] = kernel(body_kernels.contact_kernel)
    if touch.moves:
        step = body_kernels.body_step_kernel
        further["carry"] = kernel(body_kernels.carry_kernel)
        further["guard_body"] = kernel(body_kernels.guard_body_kernel)
    return assembly, {
        **further,
        "settle": settle,
        "step": kernel(
            step, launch_bounds=step_block(structure), block_dim=step_block(structure)[0]
        ),
        "read": kernel(control_kernels.read_kernel),
        "forget": kernel(control_kernels.forget_kernel),
        "adopt": kernel(control_kernels.adopt_kernel),
        "sense": kernel(control_kernels.sense_kernel),
        "hold": kernel(control_kernels.hold_kernel),
        "guard": kernel(control_kernels.guard_kernel),
    }
