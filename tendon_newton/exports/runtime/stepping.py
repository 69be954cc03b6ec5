"""MuJoCo stepped with what its model file cannot say: the hook of an exported model."""

# Numbers are Python's own here, where the law says `real` and vectors.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportReturnType=false

from __future__ import annotations

import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from tendon_newton.device_code.placeholders import HAS_MEMORY, HAS_ROTOR
from tendon_newton.device_code.slots import (
    cell_clock_effects,
    cell_effects,
    cell_lag_effects,
    joint_friction_effects,
    spring_memory,
)
from tendon_newton.device_code.structs import Flow, Joint
from tendon_newton.exports.runtime.commands import INSTANT, REMEMBERED, CommandHistory
from tendon_newton.exports.runtime.engine import mujoco
from tendon_newton.exports.runtime.facts import (
    FOLDER,
    JOINT_ROWS,
    MEMORY_SIZE,
    PARAMETERS,
    SERVO_ROWS,
)
from tendon_newton.exports.runtime.networks import open_network
from tendon_newton.exports.runtime.resting import Rest, balance
from tendon_newton.exports.runtime.servos import ExportedServo, Now
from tendon_newton.law.joint import damping_torque, spring_torque

# Time [s] in which a motion that a reading takes for rest comes to rest: far less than a command's
# jump needs to turn the slowest motion round
AT_ONCE = 1.0e-8
# How often a reading is solved, each time with the inertia of the side on which it slides
ROUNDS = 3
SAME_INERTIA = 1.0e-3  # Share of an inertia [1] by which another is the same
# MuJoCo's `solimp` of dry friction with which it creeps least
STICKING = (0.9999, 0.99999, 1.0e-4, 0.5, 2.0)


class Hold(NamedTuple):
    """The sides of a tendon's motion: between them it may be held."""

    least: Flow
    most: Flow
    sides: tuple[float, float]
    lower: float  # Least pull on the mechanism [N]
    upper: float
    speed: float  # Rate of the excursion [m/s] at which it would be held


class BenchReading(NamedTuple):
    """What the bench reports, one number per tendon."""

    angle: list[float]  # Motor angle [rad]
    angle_rate: list[float]  # Motor speed [rad/s]
    force: list[float]  # What the load cell shows [N]
    tension: list[float]  # What it would show if it were perfect [N]


def joint_of(index: int, row: dict[str, Any]) -> Any:
    """Return a joint as effects see it, with the end stops and the friction of its row."""
    joint = Joint()
    joint.index = index
    for name, value in row.items():
        setattr(joint, name, value)
    return joint


class Hook:
    """Steps a MuJoCo model whose tendons are pulled by identified servos.

    Write the desired motor angles [rad] into `command` whenever they change, then call `step`.
    `read` returns what encoders and load cells report just after the command took effect.

    The hook takes over end stops, springs, dampers and dry friction of the joints that it knows:
    it solves them as the identified model does, implicitly where they are stiff, by an inertia of
    step times damping beside each.

    Args:
        model: The exported model, or a scene that holds its bodies and tendons.
        data: The model's state.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self.model, self.data, self.network = model, data, open_network()
        self.servos = [ExportedServo(row) for row in SERVO_ROWS]
        self.joints = [joint_of(j, row) for j, row in enumerate(JOINT_ROWS)]
        self.places = [int(model.joint(joint.name).qposadr[0]) for joint in self.joints]
        self.dofs = [int(model.joint(joint.name).dofadr[0]) for joint in self.joints]
        self.tendons = [int(model.tendon(servo.numbers["name"]).id) for servo in self.servos]
        self.command = np.zeros(len(self.servos))
        self.voltage, self.enabled = 0.0, 1.0
        self.cell_lag = cell_lag_effects(0.0, 0, PARAMETERS)
        late = cell_clock_effects(0.0, 0, PARAMETERS) != 0.0
        self.cell_is_slow = self.cell_lag > 0.0 or late
        self.own_armature = model.dof_armature.copy()
        self.rotors = np.zeros(len(self.servos))  # what each adds to its tendon's inertia [kg]
        self.bow = [0.0] * len(self.servos)
        self.inertia_rows = np.repeat(np.arange(model.nv), model.M_rownnz)
        self.take_over()
        self.reset(self.command)

    def take_over(self) -> None:
        """Leave to MuJoCo's own forces only what the hook does not give."""
        model = self.model
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        # islands have copies of the constraints, which the hook's numbers would not reach
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
        for joint, dof in zip(self.joints, self.dofs, strict=True):
            number = model.joint(joint.name).id
            model.jnt_limited[number] = 0
            model.jnt_stiffness[number] = 0.0
            model.dof_damping[dof] = 0.0
            friction = joint_friction_effects(joint.friction, joint, PARAMETERS)
            model.dof_frictionloss[dof] = friction
            model.dof_solimp[dof] = STICKING
        for servo, tendon in zip(self.servos, self.tendons, strict=True):
            name = servo.numbers["name"]
            motor = model.actuator(name).id
            model.actuator_gaintype[motor] = mujoco.mjtGain.mjGAIN_FIXED
            model.actuator_biastype[motor] = mujoco.mjtBias.mjBIAS_NONE
            model.actuator_dyntype[motor] = mujoco.mjtDyn.mjDYN_NONE
            model.actuator_gainprm[motor] = 0.0
            model.tendon_damping[tendon] = 0.0
            model.tendon_armature[tendon] = 0.0
            spool = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"{name}_spool")
            if spool >= 0:  # the file alone has one, which stands still now
                model.tendon_frictionloss[spool] = 0.0
                model.tendon_limited[model.tendon(f"{name}_string").id] = 0
            model.tendon_solimp_fri[tendon] = STICKING
            holds = servo.dry or servo.greatest_speed < math.inf
            model.tendon_frictionloss[tendon] = 1.0 if holds else 0.0  # renewed in every step

    def look(self) -> None:
        """Let MuJoCo see where everything is, and put the rotors into its inertia.

        An armature of MuJoCo's own does the same, but not at a tendon that is wrapped around a
        pulley.
        """
        mujoco.mj_step1(self.model, self.data)
        if not self.rotors.any():
            return
        columns = self.model.M_colind
        for rotor, arm in zip(self.rotors, self.arms(), strict=True):
            self.data.M[:] += rotor * arm[self.inertia_rows] * arm[columns]
        mujoco.mj_factorM(self.model, self.data)
        mujoco.mj_projectConstraint(self.model, self.data)

    # ---- the state

    def reset(self, command: Any, angle: Any = None, rate: Any = None) -> None:
        """Put the model at rest under a command, friction left out, every memory relaxed.

        Args:
            command: Desired motor angles [rad], one per tendon.
            angle: Motor angles [rad] at which it is held instead.
            rate: Motor speeds [rad/s] at which it starts then.
        """
        self.command[:] = command
        self.time = 0.0
        self.data.time = 0.0
        self.commands = CommandHistory(self.command)
        self.lead = np.zeros(len(self.servos))
        self.lead_rate = np.zeros(len(self.servos))
        self.slack = [servo.elastic for servo in self.servos]
        for joint in self.joints:
            joint.memory = [0.0] * MEMORY_SIZE
        self.bow = [0.0] * len(self.servos)
        self.rotors[:] = 0.0
        self.carried = [0.0] * len(self.servos)
        self.kept = [0.0] * len(self.servos)
        self.kept_of_joint: dict[int, float] = {}
        self.next_query = 0.0
        for servo in self.servos:
            servo.memory = [0.0] * len(servo.memory)
        self.data.qvel[self.dofs] = 0.0
        rest = Rest(self, angle)
        rest.find()
        if self.network is not None:
            self.balance_network(rest)
        if rate is not None:
            arms = self.arms()[:, self.dofs]
            for arm, servo, speed in zip(arms, self.servos, rate, strict=True):
                self.data.qvel[self.dofs] += arm * (speed * servo.radius / (arm @ arm))
        self.look()
        self.tension = self.solved_tension()
        self.cells = deque([(-math.inf, list(self.tension)), (0.0, list(self.tension))])

    def excursions(self) -> tuple[list[float], list[float]]:
        """Return how much of each tendon is wound in [m] and its rate [m/s]."""
        length = [
            s.numbers["sign"] * float(self.data.ten_length[t]) + s.numbers["offset"]
            for s, t in zip(self.servos, self.tendons, strict=True)
        ]
        rate = [
            s.numbers["sign"] * float(self.data.ten_velocity[t])
            for s, t in zip(self.servos, self.tendons, strict=True)
        ]
        return length, rate

    def arms(self) -> Any:
        """Return the moment arms of all tendons [m], positive closes, shape (D, nv)."""
        model, data = self.model, self.data
        out = np.zeros((len(self.servos), model.nv))
        for row, (servo, tendon) in enumerate(zip(self.servos, self.tendons, strict=True)):
            first, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
            columns = model.ten_J_colind[first : first + count]
            out[row, columns] = servo.numbers["sign"] * data.ten_J[first : first + count]
        return out

    # ---- forces

    def now_of(self, h: float) -> list[Now]:
        """Return the present of each tendon, under its mean command over the next h [s]."""
        self.commands.note(self.time, self.command)
        length, rate = self.excursions()
        out = []
        for d, servo in enumerate(self.servos):
            start = servo.clock(self.time)
            asked = (
                self.commands.mean(d, start, servo.clock(self.time + h))
                if h > 0.0
                else self.commands.at(start)[d]
            )
            out.append(
                Now(
                    time=self.time,
                    command=float(asked),
                    length=length[d],
                    velocity=rate[d],
                    lead=float(self.lead[d]),
                    lead_rate=float(self.lead_rate[d]),
                    carried=self.carried[d],
                    voltage=self.voltage,
                    enabled=self.enabled,
                )
            )
        return out

    def joint_torques(self, h: float) -> Any:
        """Return springs, dampers and stops [N m], and note what makes them implicit."""
        out = np.zeros(self.model.nv)
        for joint, place, dof in zip(self.joints, self.places, self.dofs, strict=True):
            joint.position = float(self.data.qpos[place])
            joint.velocity = float(self.data.qvel[dof])
            joint.elapsed = 0.0
            spring = spring_torque(joint, PARAMETERS)
            damper = damping_torque(joint, PARAMETERS)
            out[dof] += spring[0] + damper[0]
            damping = -damper[2]
            bound = joint.upper if joint.position > joint.upper else joint.lower
            push = joint.stop_stiffness * (joint.position - bound)
            push += joint.stop_damping * joint.velocity
            beyond = 1.0 if bound == joint.upper else -1.0
            if not joint.lower <= joint.position <= joint.upper and push * beyond > 0.0:
                out[dof] -= push
                damping += joint.stop_damping
            self.model.dof_armature[dof] = self.own_armature[dof] + h * damping
        return out

    def hold_of(self, servo: ExportedServo, now: Now, loose: bool) -> Hold:
        """Return between what a tendon may be held, and where its motion is nearest to that."""
        rate, bound = now.velocity, servo.greatest_speed
        sides, speed = (1.0, -1.0), 0.0
        if rate > 0.5 * bound:
            sides, speed = (2.0, 1.0), bound
        if rate < -0.5 * bound:
            sides, speed = (-1.0, -2.0), -bound
        least = servo.flow(now, sides[0])
        most = least if not (servo.dry or speed) else servo.flow(now, sides[1])
        lower, upper = least.pull[0], most.pull[0]
        if loose:
            tension = servo.loose_tension(now)
            lower, upper = (servo.guided(tension, now, side) for side in (1.0, -1.0))
        if upper < lower:  # a motor that brakes its rotor while the string is taut: nothing sticks
            lower = upper = lower if rate >= speed else upper
        return Hold(least, most, sides, lower, upper, speed)

    def prepare(self, nows: list[Now], h: float, within: float | None = None) -> list[Hold]:
        """Give MuJoCo the forces of the step to come; `mj_step1` has been called.

        MuJoCo's friction gives way in proportion to its force. What it gave way by in the step
        before is asked of it on top, so that what sticks does not creep. Friction may bring a
        motion to rest within a time [s], a step by default.
        """
        within = within or h
        data = self.data
        applied = self.joint_torques(h)
        arms = self.moment_arms = self.arms()
        holds = []
        rows = self.rows = self.friction_rows()
        for d, (servo, now) in enumerate(zip(self.servos, nows, strict=True)):
            loose = self.slack[d]
            hold = self.hold_of(servo, now, loose)
            holds.append(hold)
            applied += arms[d] * (0.5 * (hold.lower + hold.upper) - self.rotors[d] * self.bow[d])
            self.next_inertia(d, hold, 0.0 if now.velocity >= hold.speed else 1.0, h)
            row = rows.get(self.tendons[d])
            if row is not None:
                half = 0.5 * (hold.upper - hold.lower)
                data.efc_frictionloss[row] = half
                sign = servo.numbers["sign"]
                kept = self.kept[d]
                data.efc_aref[row] = sign * (hold.speed - now.velocity) / within
                data.efc_aref[row] += data.efc_R[row] * min(max(kept, -half), half)
        for dof, joint_row in self.joint_rows.items():
            kept = data.efc_R[joint_row] * self.kept_of_joint.get(dof, 0.0)
            data.efc_aref[joint_row] = kept - data.qvel[dof] / within
        data.qfrc_applied[:] = applied
        return holds

    def next_inertia(self, d: int, hold: Hold, share: float, h: float) -> float:
        """Note the inertia [kg] that a tendon's rotor and its damping add in the next step.

        The share tells where the string is between the sides of its motion, 0 at the least pull.
        """
        inertia = 0.0
        if not self.slack[d]:
            low, high = hold.least.pull_gain, hold.most.pull_gain
            inertia = self.servos[d].inertia * (low + share * (high - low))
            inertia += h * max(0.0, -0.5 * (hold.least.pull[2] + hold.most.pull[2]))
        self.rotors[d] = inertia
        return inertia

    def friction_rows(self) -> dict[int, int]:
        """Return the constraint row of each tendon's dry friction, and note those of joints."""
        of_joint = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
        of_tendon = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)
        first, count = self.data.ne, self.data.nf
        kinds = self.data.efc_type[first : first + count].tolist()
        numbers = self.data.efc_id[first : first + count].tolist()
        rows = list(zip(kinds, numbers, range(first, first + count), strict=True))
        self.joint_rows = {number: row for kind, number, row in rows if kind == of_joint}
        return {number: row for kind, number, row in rows if kind == of_tendon}

    def tensions(self, nows: list[Now], holds: list[Hold]) -> tuple[list[float], list[float]]:
        """Return the true tensions [N] once MuJoCo has solved, and where each tendon is held.

        The share is 0 at its least pull and 1 at its most.
        """
        arms, rows = self.moment_arms, self.rows
        out, shares = [], []
        for d, (servo, now, hold) in enumerate(zip(self.servos, nows, holds, strict=True)):
            row = rows.get(self.tendons[d])
            share = 0.0 if now.velocity >= hold.speed else 1.0
            span = hold.upper - hold.lower
            if row is not None and span > 0.0:
                share = 0.5 + servo.numbers["sign"] * self.data.efc_force[row] / span
            shares.append(min(max(share, 0.0), 1.0))
            if self.slack[d]:
                out.append(servo.felt_tension(now))
                continue
            low, high = hold.least, hold.most
            tension = low.tension[0] + shares[-1] * (high.tension[0] - low.tension[0])
            if HAS_ROTOR:
                gain = low.tension_gain + shares[-1] * (high.tension_gain - low.tension_gain)
                rate = float(arms[d] @ self.data.qacc) + self.bow[d]
                tension -= gain * servo.inertia * rate
                slides = span <= 0.0 or not 0.0 < shares[-1] < 1.0
                if servo.numbers["direct"]:
                    self.carried[d] = low.motor_force[0] - servo.inertia * rate if slides else 0.0
            out.append(tension)
        return out, shares

    # ---- stepping

    def step(self) -> None:
        """Advance by the model's time step."""
        h = self.model.opt.timestep
        self.ask_network()
        nows = self.now_of(h)
        holds = self.prepare(nows, h)
        mujoco.mj_step2(self.model, self.data)
        self.note_cells()
        gave = self.data.efc_force.tolist()
        self.kept = [gave[self.rows[t]] if t in self.rows else 0.0 for t in self.tendons]
        self.kept_of_joint = {dof: gave[row] for dof, row in self.joint_rows.items()}
        self.tension, shares = self.tensions(nows, holds)
        was_slack = list(self.slack)
        self.let_go()
        answer = self.moment_arms @ self.data.qacc
        self.time += h
        self.look()
        _, rate = self.excursions()
        change = [(r - now.velocity) / h for r, now in zip(rate, nows, strict=True)]
        self.bow = [c - a for c, a in zip(change, answer, strict=True)]
        for d, servo in enumerate(self.servos):
            if was_slack[d]:
                self.move_spool(d, servo, nows[d], h)
        self.remember(nows, change, holds, shares, h)

    def let_go(self) -> None:
        """Let the strings go that would have to push a rotor."""
        for d, servo in enumerate(self.servos):
            if HAS_ROTOR and not self.slack[d] and self.tension[d] < servo.least:
                self.slack[d] = True
                self.lead[d] = self.lead_rate[d] = self.tension[d] = 0.0
                self.rotors[d] = 0.0

    def remember(
        self, nows: list[Now], change: list[float], holds: list[Hold], shares: list[float], h: float
    ) -> None:
        """Renew what effects remember, at the end of a step."""
        length, rate = self.excursions()
        for d, servo in enumerate(self.servos):
            if HAS_MEMORY:
                now = nows[d]._replace(
                    time=self.time,
                    length=length[d],
                    velocity=rate[d],
                    acceleration=change[d],
                    lead=float(self.lead[d]),
                    lead_rate=float(self.lead_rate[d]),
                    elapsed=h,
                )
                least, most = (servo.renewed(now, side) for side in holds[d].sides)
                servo.memory = [a + shares[d] * (b - a) for a, b in zip(least, most, strict=True)]
        for joint, place, dof in zip(self.joints, self.places, self.dofs, strict=True):
            joint.position = float(self.data.qpos[place])
            joint.velocity = float(self.data.qvel[dof])
            joint.elapsed = h
            self.renew_strain(joint)

    def renew_strain(self, joint: Any) -> None:
        """Renew what effects remember of a joint."""
        torque = spring_torque(joint, PARAMETERS)
        joint.memory = spring_memory(torque, joint, PARAMETERS, joint.memory)

    def move_spool(self, d: int, servo: ExportedServo, now: Now, h: float) -> None:
        """Turn a spool whose string is slack or stretches; catch one that has wound it in."""
        length, rate = self.excursions()
        after = self.spool_speed(servo, now, now.velocity + now.lead_rate, h)
        self.lead[d] = now.length + now.lead + h * after - length[d]
        self.lead_rate[d] = after - rate[d]
        if not servo.elastic and self.lead[d] > 0.0:
            self.catch(d, servo, after)

    def spool_speed(self, servo: ExportedServo, now: Now, speed: float, h: float) -> float:
        """Return a free spool's speed [m/s] after a step; dry friction may hold it."""
        bound = servo.greatest_speed
        damping = h * max(0.0, -servo.motor_flow(now).motor_force[2])
        inertia = servo.inertia + damping
        inward = speed + h * servo.spool_force(now, 1.0) / inertia
        outward = speed + h * servo.spool_force(now, -1.0) / inertia
        after = 0.0
        if inward > 0.0 and (speed >= 0.0 or outward > 0.0):
            after = inward if speed >= 0.0 else 0.0
        if outward < 0.0 and (speed <= 0.0 or inward < 0.0):
            after = outward if speed <= 0.0 else 0.0
        if not servo.dry:
            after = inward
        return min(max(after, -bound), bound)

    def catch(self, d: int, servo: ExportedServo, speed: float) -> None:
        """Let a string without slack stop its spool, without bounce."""
        arm = self.arms()[d]
        answer = np.zeros((1, self.model.nv))
        mujoco.mj_solveM(self.model, self.data, answer, arm[None])
        difference = speed - arm @ self.data.qvel
        share = servo.inertia * difference / (1.0 + servo.inertia * arm @ answer[0])
        self.data.qvel[:] += answer[0] * share
        self.slack[d] = False
        self.lead[d] = self.lead_rate[d] = 0.0
        flow = servo.flow(self.now_of(0.0)[d], 1.0)
        self.rotors[d] = servo.inertia * flow.pull_gain
        self.look()

    # ---- what the bench reports

    def solved_tension(self) -> list[float]:
        """Return the true tensions [N] just after a command, which MuJoCo solves for."""
        h = self.model.opt.timestep
        shafts = HAS_ROTOR and any(s.numbers["direct"] for s in self.servos)
        tension: list[float] = []
        for again in range(ROUNDS):
            used = self.rotors.copy()
            nows = self.now_of(0.0)  # from the second round on they know what a shaft carries
            holds = self.prepare(nows, h, AT_ONCE)
            mujoco.mj_fwdActuation(self.model, self.data)
            mujoco.mj_fwdAcceleration(self.model, self.data)
            mujoco.mj_fwdConstraint(self.model, self.data)
            tension, shares = self.tensions(nows, holds)
            sides = enumerate(zip(holds, shares, strict=True))
            inertia = [self.next_inertia(d, hold, share, h) for d, (hold, share) in sides]
            if (again or not shafts) and np.allclose(used, inertia, rtol=SAME_INERTIA):
                break
            self.look()
        return [max(t, s.least) for t, s in zip(tension, self.servos, strict=True)]

    def read(self) -> BenchReading:
        """Return what encoders and load cells report just after a command took effect."""
        self.ask_network()
        tension = self.solved_tension()
        angle, rate, force = [], [], []
        at = cell_clock_effects(self.time, 0, PARAMETERS)
        for d, (servo, now) in enumerate(zip(self.servos, self.now_of(0.0), strict=True)):
            side = 1.0 if now.velocity + now.lead_rate >= 0.0 else -1.0
            kept = servo.memory
            servo.memory = servo.renewed(now, side)
            reported = servo.reported_angle(now, side, tension[d])
            servo.memory = kept
            angle.append(reported[0])
            rate.append(reported[1] * (now.velocity + now.lead_rate))
            true = self.cell_value(d, at) if self.cell_is_slow else tension[d]
            force.append(cell_effects(true, self.time, 0, PARAMETERS))
        return BenchReading(angle, rate, force, tension)

    def note_cells(self) -> None:
        """Keep what slow cells showed at the start of a step."""
        if not self.cell_is_slow:
            return
        shown = [self.lagged_cell(d, self.time) for d in range(len(self.servos))]
        self.cells.append((self.time, shown))
        while len(self.cells) > 2 and self.cells[1][0] < self.time - REMEMBERED:
            self.cells.popleft()

    def lagged_cell(self, d: int, instant: float) -> float:
        """Return what a cell's lag makes of the present tension by an instant [s]."""
        since, shown = self.cells[-1]
        if self.cell_lag <= 0.0:
            return self.tension[d]
        kept = math.exp(-(instant - max(since, 0.0)) / self.cell_lag)
        return self.tension[d] + kept * (shown[d] - self.tension[d])

    def cell_value(self, d: int, instant: float) -> float:
        """Return what a cell's lag makes of the tension by a past instant [s]."""
        if instant >= self.cells[-1][0]:
            return self.lagged_cell(d, instant)
        for k in range(len(self.cells) - 1, 0, -1):
            (start, before), (end, after) = self.cells[k - 1], self.cells[k]
            if start <= instant:
                share = 1.0 if end - start == math.inf else (instant - start) / (end - start)
                return before[d] + share * (after[d] - before[d])
        return self.cells[0][1][d]

    # ---- a recording

    def begin(
        self, command: Any, voltage: float, enabled: float, rows: dict[str, Any], step: float
    ) -> None:
        """Begin a replay of `rows`, whose `start` has angles [rad] and speeds [rad/s]."""
        self.voltage, self.enabled = voltage, enabled
        self.model.opt.timestep = step
        self.reset(command, *rows.get("start", (None, None)))

    def ask(self, command: Any, voltage: float, enabled: float) -> None:
        """Set desired motor angles [rad], supply [V] and whether the motor is on."""
        self.command[:] = command
        self.voltage, self.enabled = voltage, enabled

    def report(self) -> tuple[Any, ...]:
        """Return angles, rates, forces and joints, as `replay` does."""
        reading = self.read()
        return reading.angle, reading.angle_rate, reading.force, self.data.qpos[self.places]

    def advance(self, step: float, count: int) -> None:
        """Take so many steps [s]."""
        self.model.opt.timestep = step
        for _ in range(count):
            self.step()

    # ---- a force network

    def ask_network(self) -> None:
        """Show the network the present, whenever its own period has passed, and hold its answer."""
        if self.network is None or self.time < self.next_query - INSTANT:
            return
        self.next_query += 1.0 / self.network.rate
        self.network.show(self.samples())
        self.hold_answers(self.network.ask())

    def samples(self) -> Any:
        """Return what the network is shown of each servo: angles [rad] and speed, shape (D, 3)."""
        tension = self.solved_tension()
        out = []
        for d, (servo, now) in enumerate(zip(self.servos, self.now_of(0.0), strict=True)):
            reported = servo.reported_angle(now, 1.0, tension[d])
            asked = servo.asked_angle(now, reported[0])
            out.append((asked, reported[0], reported[1] * now.velocity))
        return np.array(out, dtype=np.float32)

    def hold_answers(self, forces: Any) -> None:
        """Hold the network's forces [N] from now on."""
        for servo, now, force in zip(self.servos, self.now_of(0.0), forces, strict=True):
            servo.hold_force(float(force), now)

    def balance_network(self, rest: Rest) -> None:
        """Find the force that the network gives where that very force holds the mechanism."""
        least = max(self.servos[0].least, -self.servos[0].limit)

        def excess(force: float) -> float:
            self.hold_answers([force] * len(self.servos))
            rest.find()
            self.network.fill(self.samples())
            answer = float(self.network.ask()[0])
            return min(max(answer, least), self.servos[0].limit) - force

        balance(excess, least, self.servos[0].limit)
        self.network.fill(self.samples())


def make_hook(model: Any, data: Any) -> Hook:
    """Return the hook of a MuJoCo model that holds the exported bodies and tendons."""
    return Hook(model, data)


def make() -> Hook:
    """Return the hook of the model beside the program."""
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "model.xml"))
    return make_hook(model, mujoco.MjData(model))
