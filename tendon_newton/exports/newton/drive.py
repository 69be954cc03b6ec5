"""The drive for Newton's actuators, and a simulation of the bench."""

import math
import warnings
from dataclasses import dataclass
from typing import Any

import newton
import numpy as np
import warp as wp
from newton.actuators import ComponentKind, DriveBase, register_actuator_component
from newton.solvers import SolverMuJoCo

from tendon_newton.device_code.placeholders import FREE_SPOOL, HAS_ROTOR
from tendon_newton.device_code.structs import Joint
from tendon_newton.exports.newton.drive_kernels import (
    copy_kernel,
    drive_kernel,
    fresh_kernel,
    hold_kernel,
)
from tendon_newton.exports.newton.drive_structs import JointMore, Kept, Report, Way
from tendon_newton.exports.newton.drive_types import ParameterVector, real
from tendon_newton.exports.runtime.facts import (
    COMMAND_DELAY,
    FOLDER,
    JOINT_ROWS,
    PARAMETERS,
    RIGID,
    SERVO_ROWS,
    TIME_STEP,
)
from tendon_newton.exports.runtime.networks import open_network

BENCH = FOLDER / "bench_drive.usda"
SCHEMA = "TendonDriveAPI"
SHORTEST_SHARE = 0.25  # Share of the longest step that a step must have at least [1]
SWING_IN = 1.0  # How long [s] a bench swings in under its first command


class TendonDrive(DriveBase):
    """Servo, string and springs of a tendon; one slot for each joint that it drives.

    A slot that is reset finds every internal state at rest where its joints then are.
    """

    @dataclass
    class State(DriveBase.State):
        """What the effects remember."""

        kept: Any = None
        fresh: Any = None

        def reset(self, mask: Any = None) -> None:
            """Let slots begin anew at their next step."""
            if mask is None:
                self.fresh.fill_(1)
            else:
                wp.launch(fresh_kernel, len(self.fresh), inputs=[mask, self.fresh])

        def assign(self, other: Any) -> None:
            """Copy another state."""
            wp.copy(self.kept, other.kept)
            wp.copy(self.fresh, other.fresh)

    @classmethod
    def resolve_arguments(cls, args: dict[str, Any]) -> dict[str, Any]:
        """Return the slot's tendon, and the place of its joint among the bench's."""
        if "tendon" not in args or "joint" not in args:
            raise ValueError("TendonDrive needs newton:tendon and newton:joint")
        return {"tendon": float(args["tendon"]), "joint": float(args["joint"])}

    def __init__(self, tendon: Any, joint: Any) -> None:
        self._slots = [tendon.numpy().astype(np.int32), joint.numpy().astype(np.int32)]
        self.parameters: Any = None

    def finalize(self, device: Any, num_actuators: int) -> None:
        """Place the numbers on a device."""
        self.device, count = device, num_actuators

        def array(values: Any, dtype: Any) -> Any:
            return wp.array(values, dtype=dtype, device=device)

        self.tendon_of, self.joint_of = (array(slots, int) for slots in self._slots)
        self.parameters = array(np.tile(PARAMETERS, (count, 1)), ParameterVector)
        terms = max(len(row["factor"]) for row in SERVO_ROWS)
        factor = np.zeros((len(SERVO_ROWS), terms))
        powers = np.zeros((len(SERVO_ROWS), terms, len(JOINT_ROWS)), dtype=np.int32)
        paths = []
        for d, row in enumerate(SERVO_ROWS):
            factor[d, : len(row["factor"])] = row["factor"]
            powers[d, : len(row["factor"])] = row["powers"]
            path = Way()
            path.terms = len(row["factor"])
            path.inertia, path.rotor = row["inertia"], row["rotor"]
            path.radius, path.limit, path.least = row["radius"], row["limit"], row["least"]
            paths.append(path)
        self.factor = array(factor, real)
        self.powers = wp.array(powers, dtype=int, ndim=3, device=device)
        self.paths = array(paths, Way)
        joints, more = [], []
        for row in JOINT_ROWS:
            joint, one = Joint(), JointMore()
            for name in ("stiffness", "rest", "damping", "lower", "upper"):
                setattr(joint, name, row[name])
            joints.append(joint)
            one.stiffness, one.damping = row["written"]  # what the solver does already
            one.stop_stiffness, one.stop_damping = row["stop_stiffness"], row["stop_damping"]
            one.friction, one.inertia = row["friction"], row["inertia"]
            more.append(one)
        self.joints, self.joints_more = array(joints, Joint), array(more, JointMore)
        self.voltage = wp.zeros(count, dtype=real, device=device)
        self.enabled = wp.full(count, 1.0, dtype=real, device=device)
        self.report = wp.zeros(count, dtype=Report, device=device)
        self._after = wp.zeros(count, dtype=Kept, device=device)
        depth = math.ceil(COMMAND_DELAY / (SHORTEST_SHARE * TIME_STEP)) + 1
        self.log = wp.zeros((count, depth), dtype=real, device=device)

    def is_stateful(self) -> bool:
        """Return True."""
        return True

    def is_graphable(self) -> bool:
        """Return True: a network is asked between steps."""
        return True

    def state(self, num_actuators: int, device: Any) -> Any:
        """Return a state that begins at rest."""
        return TendonDrive.State(
            kept=wp.zeros(num_actuators, dtype=Kept, device=device),
            fresh=wp.full(num_actuators, 1, dtype=int, device=device),
        )

    def compute(
        self,
        positions: Any,
        velocities: Any,
        target_pos: Any,
        target_vel: Any,
        feedforward: Any,
        pos_indices: Any,
        vel_indices: Any,
        target_pos_indices: Any,
        target_vel_indices: Any,
        forces: Any,
        state: Any,
        dt: Any,
        device: Any = None,
        **unused: Any,
    ) -> None:
        """Write the torque or force of each slot."""
        if COMMAND_DELAY / dt > self.log.shape[1] - 1:
            raise ValueError(
                f"the step must be {SHORTEST_SHARE * TIME_STEP:g} s or longer, for the log of late "
                f"commands; it is {dt:g} s"
            )
        wp.launch(
            drive_kernel,
            len(forces),
            inputs=[
                *(positions, velocities, target_pos, pos_indices, vel_indices, target_pos_indices),
                *(self.tendon_of, self.joint_of, self.paths, self.factor, self.powers),
                *(self.joints, self.joints_more, self.parameters, self.voltage, self.enabled),
                *(state.fresh, state.kept, self.log, int(COMMAND_DELAY / dt + 0.5), dt),
            ],
            outputs=[forces, self._after, self.report],
            device=device or self.device,
        )

    def update_state(self, current_state: Any, next_state: Any) -> None:
        """Write what was remembered into the next state."""
        wp.launch(
            copy_kernel,
            len(self._after),
            inputs=[self._after],
            outputs=[next_state.kept, next_state.fresh],
            device=self.device,
        )


def drive_class(arguments: dict[str, Any]) -> type:
    """Return the drive; what other schemas of the same prim say is theirs."""
    for name in set(arguments) - {"tendon", "joint"}:
        del arguments[name]
    return TendonDrive


def register() -> None:
    """Let Newton's USD reader know the drive, in place of another bench's."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a second registration
        register_actuator_component(SCHEMA, drive_class, ComponentKind.DRIVE)


# ---- a simulation of the bench


class Simulation:
    """Worlds that hold the bench, stepped by SolverMuJoCo.

    Errors of friction and strings fall with the step [s].
    """

    def __init__(self, worlds: int = 1, step: float = TIME_STEP, device: Any = None) -> None:
        register()
        self.worlds, self.dt, self.device = worlds, step, device
        bench, builder = newton.ModelBuilder(), newton.ModelBuilder()
        SolverMuJoCo.register_custom_attributes(bench)
        bench.add_usd(str(BENCH), collapse_fixed_joints=True)
        loose = [j for j, owner in enumerate(bench.joint_articulation) if owner < 0]
        if loose:  # a chain of one link
            bench.add_articulation(loose, label="bench")
        SolverMuJoCo.register_custom_attributes(builder)
        builder.replicate(bench, worlds)
        self.model = builder.finalize(device=device)
        self.solver = SolverMuJoCo(self.model, disable_contacts=True)
        self.states: list[Any] = [self.model.state(), self.model.state()]
        self.control: Any = self.model.control()
        (self.actuator,) = self.model.actuators
        self.drive: Any = self.actuator.drive
        self.kept: list[Any] = [self.actuator.state(), self.actuator.state()]
        self.slot_tendon = self.drive.tendon_of.numpy()
        per_world = len(self.slot_tendon) // worlds
        self.slots = [
            [
                w * per_world + int(np.flatnonzero(self.slot_tendon[:per_world] == d)[0])
                for d in range(len(SERVO_ROWS))
            ]
            for w in range(worlds)
        ]
        self.graphs: dict[Any, Any] = {}
        self.mass: list[Any] = [None, None]
        self.at, self.time, self.next_query = 0, 0.0, 0.0
        self.network = open_network()

    def command(self, angles: Any) -> None:
        """Set the desired motor angles [rad], shape (D,) or (W, D)."""
        angles = np.broadcast_to(
            np.asarray(angles, dtype=np.float32), (self.worlds, len(SERVO_ROWS))
        )
        target = self.control.joint_target_q.numpy()
        place = self.actuator.target_pos_indices.numpy().astype(int)
        world = np.arange(len(place)) // (len(place) // self.worlds)
        target[place] = angles[world, self.slot_tendon]
        self.control.joint_target_q.assign(target)

    def reset(self, angles: Any, joints: Any = None, rates: Any = None) -> None:
        """Begin anew, every internal state at rest.

        Args:
            angles: Desired motor angles [rad].
            joints: Joint positions [rad, m], shape (J,) or (W, J); without them the bench is let go
                at its springs' rest and swings in for `SWING_IN` seconds.
            rates: Their rates.
        """
        count = len(JOINT_ROWS)
        if joints is None:
            self.reset(angles, [row["rest"] for row in JOINT_ROWS])
            self.step(round(SWING_IN / self.dt))
            joints = self.states[self.at].joint_q.numpy().reshape(self.worlds, count)
        rates = np.zeros(count) if rates is None else rates
        state = self.states[0]
        for array, values in ((state.joint_q, joints), (state.joint_qd, rates)):
            array.assign(np.broadcast_to(values, (self.worlds, count)).ravel().astype(np.float32))
        newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)
        for kept in self.kept:
            kept.reset()
        self.at, self.time, self.next_query = 0, 0.0, 0.0
        self.command(angles)
        if self.network is not None:
            self._evaluate()
            wp.copy(self.kept[0].drive_state.kept, self.kept[1].drive_state.kept)
            self.kept[0].drive_state.fresh.zero_()
            self.network.fill(self._samples())
            self._hold(self.network.ask())

    def _evaluate(self) -> None:
        """Reckon the forces of the present."""
        self.control.joint_f.zero_()
        here, there = self.at, 1 - self.at
        self.actuator.step(
            self.states[here], self.control, self.kept[here], self.kept[there], self.dt
        )

    def _advance(self) -> None:
        self._evaluate()
        here, there = self.at, 1 - self.at
        self.solver.step(self.states[here], self.states[there], self.control, None, self.dt)

    def step(self, count: int = 1) -> None:
        """Advance by some steps."""
        for _ in range(count):
            self.ask_network()
            self._try_step()
            self.at = 1 - self.at
            self.time += self.dt

    def _try_step(self) -> None:
        """Advance into the other state, which the next step overwrites."""
        self._launch(("step", self.at, round(self.dt, 12)), self._advance)

    def _launch(self, name: Any, work: Any) -> None:
        """Do some work on the device, which is captured the first time."""
        if name not in self.graphs:
            work()  # compiles and allocates before the capture
            with wp.ScopedCapture(device=self.model.device) as capture:
                work()
            self.graphs[name] = capture.graph
        wp.capture_launch(self.graphs[name])

    def read(self) -> dict[str, Any]:
        """Return angle [rad], rate [rad/s] and force [N] of each tendon, shape (W, D)."""
        self.ask_network()
        self._try_step()
        report = self.drive.report.numpy()[np.array(self.slots)]
        force = report["tension"].copy()
        shaft = HAS_ROTOR and not FREE_SPOOL
        change = self._excursion_change() if shaft or RIGID else []
        for d, row in enumerate(SERVO_ROWS):
            if shaft:  # what its rotor does not take
                force[:, d] -= report["tension_gain"][:, d] * row["rotor"] * change[d]
            elif RIGID:  # what lets spool and mechanism accelerate alike
                taut = (force[:, d] > 0.0) & (report["tension_gain"][:, d] > 0.0)
                apart = (report["spool_change"][:, d] - change[d])[taut]
                give = 1.0 / (report["tension_gain"][taut, d] * row["rotor"])
                give = give + report["pull_gain"][taut, d] * self._give(d)[taut]
                force[taut, d] = np.maximum(force[taut, d] + apart / give, 0.0)
        return {"angle": report["angle"], "rate": report["rate"], "force": force}

    def _arms(self, d: int, k: int) -> Any:
        """Return the moment arms of a tendon in one of both states, shape (W, J)."""
        row = SERVO_ROWS[d]
        q = self.states[k].joint_q.numpy().reshape(self.worlds, -1).astype(np.float64)
        powers, out = np.array(row["powers"]), np.zeros_like(q)
        for j in range(q.shape[1]):
            lower = powers.copy()
            lower[:, j] = np.maximum(powers[:, j] - 1, 0)
            terms = np.prod(q[:, None, :] ** lower, axis=2)
            out[:, j] = terms @ (np.array(row["factor"]) * powers[:, j])
        return out

    def _excursion_change(self) -> list[Any]:
        """Return how each tendon's excursion accelerates in the step just tried [m/s2]."""
        rates = [
            state.joint_qd.numpy().reshape(self.worlds, -1).astype(np.float64)
            for state in self.states
        ]
        speeds = [
            [np.sum(self._arms(d, k) * rates[k], axis=1) for k in (self.at, 1 - self.at)]
            for d in range(len(SERVO_ROWS))
        ]
        return [(after - before) / self.dt for before, after in speeds]

    def _give(self, d: int) -> Any:
        """Return by how much a pull on a tendon accelerates it [1/kg], shape (W,)."""
        count = len(JOINT_ROWS)
        self._launch(("mass", self.at), self._weigh)
        mass = self.mass[self.at].numpy()
        mass = mass.reshape(self.worlds, *mass.shape[-2:])[:, :count, :count].astype(np.float64)
        arms = self._arms(d, self.at)
        return np.sum(arms * np.linalg.solve(mass, arms[:, :, None])[:, :, 0], axis=1)

    def _weigh(self) -> None:
        """Reckon the mass matrix of the present."""
        self.mass[self.at] = newton.eval_mass_matrix(self.model, self.states[self.at])

    def ask_network(self) -> None:
        """Ask the force network, whenever its own period has passed, and hold its answer."""
        if self.network is not None and self.time >= self.next_query - 1.0e-6:
            self.next_query += 1.0 / self.network.rate
            self._evaluate()
            self.network.show(self._samples())
            self._hold(self.network.ask())

    def _samples(self) -> Any:
        report = self.drive.report.numpy()
        return np.stack([report[n] for n in ("asked", "angle", "rate")], axis=1).astype(np.float32)

    def _hold(self, forces: Any) -> None:
        report = self.drive.report.numpy()
        limit = np.array([row["limit"] for row in SERVO_ROWS])[self.slot_tendon]
        forces = np.clip(np.asarray(forces, dtype=np.float64).ravel(), -limit, limit)
        answer = PARAMETERS[0] * report["angle"] + PARAMETERS[1] * report["rate"]
        arrays = [wp.array(x, dtype=real, device=self.model.device) for x in (forces, answer)]
        kept = self.kept[self.at].drive_state.kept
        wp.launch(hold_kernel, len(forces), inputs=[*arrays, kept], device=self.model.device)

    # ---- a recording

    def begin(
        self, command: Any, voltage: float, enabled: float, rows: dict[str, Any], step: float
    ) -> None:
        """Begin a replay of `rows`, which may have `joints` and `rates` of its first."""
        self.dt = step
        self._set_inputs(voltage, enabled)
        self.reset(command, rows.get("joints"), rows.get("rates"))

    def ask(self, command: Any, voltage: float, enabled: float) -> None:
        """Set desired motor angles [rad], supply [V] and whether the motor is on."""
        self.command(command)
        self._set_inputs(voltage, enabled)

    def _set_inputs(self, voltage: float, enabled: float) -> None:
        self.drive.voltage.fill_(voltage)
        self.drive.enabled.fill_(enabled)

    def report(self) -> tuple[Any, ...]:
        """Return angles, rates, forces and joints of the first world, as `replay` does."""
        reading = self.read()
        joints = self.states[self.at].joint_q.numpy()
        return reading["angle"][0], reading["rate"][0], reading["force"][0], joints

    def advance(self, step: float, count: int) -> None:
        """Take so many steps [s]."""
        self.dt = step
        self.step(count)
