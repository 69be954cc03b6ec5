"""Many worlds under a policy: commands in, readings out, as torch tensors at the control rate."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
import warp as wp
from torch import Tensor

from tendon_newton.actuators import find_actuator
from tendon_newton.actuators.networks.query import NetworkForm, open_query, with_hold
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.model_file import Model
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.held_force import HeldForce
from tendon_newton.simulation.hosts.tendon_solver import LONGEST_STEP, TendonSolver
from tendon_newton.simulation.hosts.torch_bridge import Graph, torch_stream
from tendon_newton.simulation.kernels.reading_kernels import (
    accept_kernel,
    finite_kernel,
    tip_kernel,
)
from tendon_newton.simulation.model.mechanism_arrays import (
    OF_A_WORLD,
    coordinate_axis,
    moving_joints,
)
from tendon_newton.simulation.model.stated_size import check_size
from tendon_newton.simulation.model.structure import Precision

SHOWN_WORLDS = 8  # Most worlds that a message names


@dataclass(frozen=True, kw_only=True)
class ControlReading:
    """What the sensors of all worlds report; the tensors are rewritten by the next step or reset.

    `torch.Tensor.clone` keeps one.
    """

    motor_position: Tensor
    """Angle that the encoder reports [rad], shape (W, D)."""
    motor_velocity: Tensor
    """Rate of the motor angle [rad/s], shape (W, D)."""
    force: Tensor
    """Tension at the load cell [N], shape (W, D)."""
    joint_position: Tensor
    """Joint angles [rad] or travels [m], shape (W, J)."""
    joint_velocity: Tensor
    """Rates of the joints [rad/s, m/s], shape (W, J)."""
    tip: Tensor | None
    """The tip in the base frame [m], shape (W, 3), where the bench has one."""
    diverged: Tensor
    """Worlds that left every physical range since their last reset, shape (W,)."""


class ControlLoop:
    """W worlds of one mechanism under commands that are held for a control step.

    A command is what a policy asks of the servos: each call of `step` holds it for one control step
    and returns what the sensors report at its end. `reset` puts worlds where a run begins, be it
    one or all; such a world behaves as in a fresh loop, to the last bit. A `learned` actuator is
    queried at its network's rate; its history begins as if the first sample had always been there.

    A world whose state or command is no longer finite is marked in `ControlReading.diverged` and
    stays where it was last, at rest, until it is reset; the others are unharmed.

    Numbers of the model and the bench may differ by world and change between any two steps:
    `numbers` gives those of actuator and effects, `bench_numbers` those of the mechanism, as
    tensors to write to. `held.scale` multiplies what a servo with a network gives.

    Args:
        mechanism: The bench.
        model: Actuator and effects with their numbers.
        world_count: Number of worlds W.
        rate: Control steps per second [Hz]; the rate of a force network is a multiple of it.
        max_step: Longest substep [s].
        precision: Scalar inside the kernels; what goes in and out is float32.
        effects: Further effects at null, whose numbers may be set later.
        network: How the network of a `learned` actuator's file runs: as its TorchScript module, or
            as the kernels compiled from its weights; or a network in place of the file's.
        device: Warp device, such as ``cpu`` or ``cuda:0``.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        model: Model,
        world_count: int,
        *,
        rate: float = 20.0,
        max_step: float = LONGEST_STEP,
        precision: Precision = "float64",
        effects: Sequence[str] = (),
        network: NetworkForm | ForceQuery = "fused",
        device: Any = None,
    ) -> None:
        if not 0.1 <= rate <= 10_000.0:
            raise InvalidParameter(f"a control rate must be 0.1 to 10000 Hz; it is {rate}")
        check_size(model.actuator, mechanism)
        model = model.on_bench(mechanism.name)
        overrides = model.bench_overrides.get(mechanism.name)
        bench = mechanism if overrides is None else override_mechanism(mechanism, overrides)
        self.rate = rate
        self.world_count = world_count
        self.mechanism_name = mechanism.name
        self._newton: Any = build_model(bench, world_count, device=device)
        self.device = self._newton.device
        query: ForceQuery | None = None
        if find_actuator(model.actuator.name).held:
            by_file = isinstance(network, str)
            query = open_query(model, network, self.device) if by_file else network
            model = with_hold(model, query.hold)
        self.solver = TendonSolver(
            self._newton,
            model,
            max_step=max_step,
            precision=precision,
            effects=effects,
            update_bodies=False,
        )
        self.held: HeldForce | None = None
        """The forces of a `learned` actuator, None for an actuator that is an equation."""
        if self.solver.holds_force and query is not None:
            self.held = HeldForce(self.solver, query)
        self._steps = 1 if self.held is None else self.held.steps_per(rate)
        self._begun = False
        self.solver.load()
        self._make_tensors(bench.tip is not None)
        self._make_graphs()

    def __repr__(self) -> str:
        """Say what it steps."""
        return f"ControlLoop({', '.join(f'{name} {value}' for name, value in self._words())})"

    def _repr_html_(self) -> str:
        """Show the same as a table in a notebook."""
        return html_table("ControlLoop", ("what", "value"), self._words())

    def _words(self) -> list[tuple[str, object]]:
        """Return what it steps."""
        return [
            ("mechanism", self.mechanism_name),
            ("worlds", self.world_count),
            ("tendons", self.tendon_count),
            ("joints", self.joint_count),
            ("rate", f"{self.rate:g} Hz"),
            ("device", self.device),
        ]

    @property
    def tendon_count(self) -> int:
        """Number of tendons D of each world."""
        return self.solver.tendon_count

    @property
    def joint_count(self) -> int:
        """Number of joints J of each world."""
        return self.solver.joint_count

    def numbers(self, owner: str, parameter: str) -> Tensor:
        """Return a number of the actuator or an effect by world, shape (W,), to write to.

        A mechanism of K equal chains, such as a hand, has one by world and chain, shape (W, K).

        Raises:
            UnknownName: The model has no such effect, or it has no such parameter.
        """
        column = self.solver.table.column(owner, parameter)
        numbers = wp.to_torch(self.solver.parameters)[:, column]
        chains = self.solver.chain_count
        return numbers if chains == 1 else numbers.unflatten(0, (self.world_count, chains))

    def bench_numbers(self, name: str) -> Tensor:
        """Return numbers of the mechanism by world, shape (W, ...), to write to.

        Such as ``mass`` [kg] (W, J), ``stiffness`` [N m/rad] (W, J), ``spool_radius`` [m] (W, D) or
        ``arms`` [m] (W, D, J), of a mechanism of equal chains at the joints of a tendon's own.

        Raises:
            UnknownName: No such numbers.
        """
        numbers = wp.to_torch(self.solver.bench_numbers(name))
        if name.startswith(OF_A_WORLD):
            return numbers
        axis = coordinate_axis(name)
        if axis is not None:  # a spool that moves on its own has a column, but no number to set
            joints = self.solver.joint_count // self.solver.chain_count
            numbers = numbers.narrow(axis, 0, joints)
        if self.solver.chain_count == 1:
            return numbers
        return numbers.unflatten(0, (self.world_count, -1)).flatten(1, 2)

    def reset(
        self,
        command: Tensor,
        worlds: Tensor | None = None,
        *,
        joint_position: Tensor | None = None,
        joint_velocity: Tensor | None = None,
        body_pose: Tensor | None = None,
        body_velocity: Tensor | None = None,
    ) -> ControlReading:
        """Begin anew in some worlds: time 0, every internal state and delay relaxed.

        Args:
            command: Motor angles [rad] that were asked for all the time before, shape (W, D); the
                rows of other worlds are not read.
            worlds: Mask of the worlds to reset, shape (W,); all by default.
            joint_position: Where they begin [rad, m], shape (W, J); by default in the friction-free
                equilibrium of the command.
            joint_velocity: Their rates, shape (W, J); at rest by default.
            body_pose: Where free bodies begin, shape (W, 7): place [m], quaternion (x, y, z, w);
                where their mechanism has them by default. Joints find their equilibrium past them.
            body_velocity: Their velocities [m/s] and angular velocities [rad/s], shape (W, 6); at
                rest by default.

        Raises:
            InvalidParameter: A number that counts is not finite, or a shape is wrong, or nothing
                is free to move.
        """
        chosen = self._mask(worlds)
        at_rest = joint_position is None
        if at_rest and joint_velocity is not None:
            raise InvalidParameter("joint_velocity needs a joint_position to begin from")
        self._take("command", command, self._command, chosen)
        still = torch.zeros_like(self.reading.joint_velocity)
        for name, values in (
            ("joint_position", joint_position),
            ("joint_velocity", joint_velocity),
        ):
            given = still if values is None else values
            self._take(name, given, getattr(self.reading, name), chosen)
        self._take_body(body_pose, body_velocity, chosen)
        self._chosen.copy_(chosen)
        with torch_stream(self.device):
            self.solver.begin(self._state, self._chosen_array, at_rest=at_rest)
            if self.held is not None:
                self.held.begin(self._state, self._chosen_array, at_rest=at_rest)
            self._report()
        self.reading.diverged.logical_and_(~self._chosen)
        self._begun = True
        return self.reading

    def step(self, command: Tensor) -> ControlReading:
        """Hold a command for one control step.

        Args:
            command: Motor angles [rad], shape (W, D); a world with one that is not finite keeps its
                last command and counts as diverged.

        Raises:
            InvalidParameter: The worlds have never been reset, or the shape is wrong.
        """
        if not self._begun:
            raise InvalidParameter("worlds must be put somewhere before they step; call reset")
        self._check_shape("command", command, self._command)
        self._asked.copy_(command)
        self._advance()
        return self.reading

    def contact_forces(self) -> Tensor:
        """Return what obstacles do to links now [N], shape (W, C, O, 3), in the axes of the base.

        C capsules of the links and O obstacles in their order; the tensor is rewritten by the next
        call.
        """
        with torch_stream(self.device):
            self.solver.read_contacts(self._state)
        return self._contact_force

    @property
    def body_pose(self) -> Tensor:
        """Where free bodies are now: place [m], quaternion (x, y, z, w), shape (W, 7).

        The tensor is rewritten by the next step; where nothing is free to move its shape is (W, 0).
        """
        return self._body_pose

    @property
    def body_velocity(self) -> Tensor:
        """Velocities of the bodies [m/s, rad/s], shape (W, 6), rewritten too."""
        return self._body_velocity

    def require_finite(self) -> None:
        """Raise an error if a world has diverged since its last reset.

        Raises:
            SimulationDiverged: Some have; the message names them.
        """
        worlds = torch.nonzero(self.reading.diverged).ravel().tolist()
        if worlds:
            named = ", ".join(map(str, worlds[:SHOWN_WORLDS]))
            more = f" and {len(worlds) - SHOWN_WORLDS} more" if len(worlds) > SHOWN_WORLDS else ""
            raise SimulationDiverged(
                f"commands and states must stay finite; in world {named}{more} of "
                f"{self.world_count} they did not"
            )

    def _make_tensors(self, has_tip: bool) -> None:
        """Let torch see what Warp works on."""
        worlds, solver = self.world_count, self.solver
        self._state: Any = self._newton.state()
        self._command = wp.to_torch(solver.command)
        self._asked_array = wp.zeros_like(solver.command)
        self._asked = wp.to_torch(self._asked_array)
        self._chosen_array = wp.zeros(worlds, dtype=wp.bool, device=self.device)
        self._chosen = wp.to_torch(self._chosen_array)
        self._contact_force = wp.to_torch(solver.contact_force)
        self._diverged = wp.zeros(worlds, dtype=wp.bool, device=self.device)
        self._tip = wp.zeros(worlds if has_tip else 0, dtype=wp.vec3f, device=self.device)
        self._tip_inputs = self._tip_inputs_of(self._newton) if has_tip else []
        position, velocity = (
            wp.to_torch(numbers).view(worlds, -1)
            for numbers in (self._state.joint_q, self._state.joint_qd)
        )
        joints = solver.joint_count  # behind them stand those of a free body
        self._body_pose, self._body_velocity = position[:, joints:], velocity[:, joints:]
        self._first_pose = self._body_pose.clone()
        self.reading = ControlReading(
            motor_position=wp.to_torch(solver.motor_position),
            motor_velocity=wp.to_torch(solver.motor_velocity),
            force=wp.to_torch(solver.force),
            joint_position=position[:, :joints],
            joint_velocity=velocity[:, :joints],
            tip=wp.to_torch(self._tip) if has_tip else None,
            diverged=wp.to_torch(self._diverged),
        )
        """The last reading."""

    def _tip_inputs_of(self, model: Any) -> list[Any]:
        """Return what the tip's place is made of."""
        return [
            wp.array(moving_joints(model), dtype=int, device=self.device),
            model.joint_type, model.joint_parent, model.joint_child,
            model.joint_X_p, model.joint_X_c, model.joint_qd_start, model.joint_axis,
            model.joint_q_start, self._state.joint_q, model.tendon.tip_body, model.tendon.tip_point,
        ]  # fmt: skip

    def _make_graphs(self) -> None:
        """Decide what is recorded: on CUDA a whole step, on a CPU what lies between torch's parts.

        Torch's part of a step is a query of a TorchScript module.
        """
        whole = self.device.is_cuda or self.held is None or self.held.is_warp_only
        self._advance = Graph(self._control_step, self.device, enabled=whole)
        self._simulate = Graph(self._simulate_eagerly, self.device, enabled=not whole)
        self._finish = Graph(self._report, self.device, enabled=not whole)

    def _control_step(self) -> None:
        """Let the command in, simulate, let the readings out."""
        wp.launch(
            accept_kernel,
            self.world_count,
            inputs=[self.tendon_count, self._asked_array, self.solver.command, self._diverged],
            device=self.device,
        )
        for _ in range(self._steps):
            if self.held is not None:
                self.held.renew(self._state)
            self._simulate()
        self._finish()

    def _simulate_eagerly(self) -> None:
        """Take all worlds to the next query."""
        self.solver.step(self._state, self._state, None, None, 1.0 / (self.rate * self._steps))

    def _report(self) -> None:
        """Stop what has diverged, and read the sensors."""
        worlds, solver, state = self.world_count, self.solver, self._state
        solver.guard(state, self._diverged)
        solver.read_sensors(state)
        readings = [solver.motor_position, solver.motor_velocity, solver.force, self._diverged]
        inputs = [self.tendon_count, *readings]
        wp.launch(finite_kernel, worlds, inputs=inputs, device=self.device)
        if self.reading.tip is not None:
            outputs = [state.body_q, self._tip]
            wp.launch(tip_kernel, worlds, self._tip_inputs, outputs, device=self.device)

    def _mask(self, worlds: Tensor | None) -> Tensor:
        """Return a mask of worlds on the device, shape (W,)."""
        if worlds is None:
            return torch.ones_like(self._chosen)
        if worlds.dtype != torch.bool or tuple(worlds.shape) != (self.world_count,):
            raise InvalidParameter(
                f"worlds must be a mask, shape ({self.world_count},) of bool; it is "
                f"{tuple(worlds.shape)} of {worlds.dtype}"
            )
        return worlds.to(self._chosen.device)

    def _take_body(self, pose: Tensor | None, velocity: Tensor | None, chosen: Tensor) -> None:
        """Write where the chosen worlds' bodies begin, and how fast they are then."""
        if not self.solver.moves_body:
            if pose is not None or velocity is not None:
                raise InvalidParameter(
                    "body_pose and body_velocity need an obstacle with a mass; there is none"
                )
            return
        pose = self._first_pose if pose is None else pose
        still = torch.zeros_like(self._body_velocity)
        self._take("body_pose", pose, self._body_pose, chosen)
        self._take(
            "body_velocity", still if velocity is None else velocity, self._body_velocity, chosen
        )
        turn = self._body_pose[:, 3:]
        turn.div_(turn.norm(dim=-1, keepdim=True))

    def _take(self, name: str, values: Tensor, target: Tensor, chosen: Tensor) -> None:
        """Write the chosen worlds' rows to a tensor that Warp sees."""
        self._check_shape(name, values, target)
        rows = values.to(target.device, target.dtype)
        if not bool(torch.isfinite(rows[chosen]).all()):
            raise InvalidParameter(f"{name} must be finite in every world that is reset")
        target.copy_(torch.where(chosen[:, None], rows, target))

    def _check_shape(self, name: str, values: Tensor, target: Tensor) -> None:
        if values.shape != target.shape:
            raise InvalidParameter(
                f"{name} must have the shape {tuple(target.shape)}; it has {tuple(values.shape)}"
            )
