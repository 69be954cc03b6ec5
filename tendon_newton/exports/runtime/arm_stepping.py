"""MuJoCo stepped with the servos of an arm, each of which goes where its own law takes it."""

# Numbers are Python's own here, where the law says `real` and vectors.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportReturnType=false

from __future__ import annotations

from typing import Any

import numpy as np

from tendon_newton.device_code.slots import clock_effects
from tendon_newton.exports.runtime.commands import CommandHistory
from tendon_newton.exports.runtime.engine import mujoco
from tendon_newton.exports.runtime.facts import FOLDER, SERVO_ROWS
from tendon_newton.exports.runtime.jets import MemoryVector
from tendon_newton.law.spool import SETTLED
from tendon_newton.simulation.kernels.position_kernels import carried, followed, profiled, reported

BANDWIDTH = 100.0  # How fast a joint comes back to its servo once nothing holds it off [rad/s]
# Inertia of a geared motor at its joint [kg m2], with which a light link holds what it touches.
# Nothing of a free motion depends on it. Chosen: a hobby servo has some times that.
ROTOR = 0.01
EASED = 0.5  # Share of its way to the load that is felt that a load takes in a step [1]


class ArmServo:
    """One servo: where it is, as it counts, whatever it takes to hold it there.

    The servo's row has its name, its numbers, and how the joint's angle follows from its own.
    """

    def __init__(self, row: dict[str, Any]) -> None:
        self.name, self.numbers = row["name"], row["numbers"]
        self.sign, self.zero = row["sign"], row["zero"]
        self.compliance = self.numbers[0]

    def start(self, command: float, angle: float | None) -> None:
        """Rest at a command, or at a measured angle [rad]."""
        self.shaft = command if angle is None else angle - reported(self.numbers, 0.0)
        self.drive = self.shaft
        self.memory = profiled(self.numbers, command, SETTLED, MemoryVector(self.shaft))

    def clock(self, time: float) -> float:
        """Return the instant [s] whose command acts at a time."""
        return clock_effects(time, 0, self.numbers)

    def follow(self, command: float, elapsed: float, load: float) -> None:
        """Move on under a command [rad] and a load [N m]; in no time take up what both ask for."""
        self.drive = followed(self.numbers, self.drive, command, elapsed, self.memory, load)
        if elapsed > 0.0:
            self.memory = profiled(self.numbers, command, elapsed, self.memory)
        self.shaft = carried(self.numbers, self.shaft, self.drive)

    @property
    def joint_angle(self) -> float:
        """Where it takes its joint [rad]."""
        return self.sign * reported(self.numbers, self.shaft) + self.zero


class ArmHook:
    """Steps a MuJoCo model whose joints are turned by identified servos.

    Write what the servos are told [rad], as they count, into `command` whenever it changes, then
    call `step`. `read` returns what the encoders report just after the command took effect.

    A servo gives way to its load by its compliance: to the arm's weight, and to what the arm meets.
    The hook takes over springs, dampers and dry friction of these joints.

    Args:
        model: The exported model, or a scene that holds its bodies and joints.
        data: The model's state.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self.model, self.data = model, data
        self.still = mujoco.MjData(model)
        self.servos = [ArmServo(row) for row in SERVO_ROWS]
        joints = [model.joint(servo.name) for servo in self.servos]
        self.places = [int(joint.qposadr[0]) for joint in joints]
        self.dofs = [int(joint.dofadr[0]) for joint in joints]
        self.sign = np.array([servo.sign for servo in self.servos])
        self.command = np.zeros(len(self.servos))
        self.take_over([int(joint.id) for joint in joints])
        inertia = 1.0 / model.dof_invweight0[self.dofs] + ROTOR
        compliance = np.array([servo.compliance for servo in self.servos])
        # a load that is felt through a stiff hold would swing up where it were taken whole
        self.ease = EASED / (1.0 + compliance * inertia * BANDWIDTH**2)
        self.reset(self.command)

    def take_over(self, joints: list[int]) -> None:
        """Leave to MuJoCo's own forces only what the hook does not give."""
        model = self.model
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        model.jnt_stiffness[joints] = 0.0
        model.dof_damping[self.dofs] = 0.0
        model.dof_frictionloss[self.dofs] = 0.0
        model.dof_armature[self.dofs] = ROTOR
        for servo in self.servos:
            motor = model.actuator(servo.name).id
            model.actuator_gainprm[motor] = 0.0
            model.actuator_biasprm[motor] = 0.0

    def reset(self, command: Any, angle: Any = None) -> None:
        """Put the arm at rest where it is told to be, or at measured angles [rad]."""
        self.command[:] = command
        self.time = 0.0
        self.data.time = 0.0
        self.commands = CommandHistory(self.command)
        for d, servo in enumerate(self.servos):
            servo.start(float(command[d]), None if angle is None else float(angle[d]))
        self.push = np.zeros(len(self.servos))
        self.goal, self.rate = self.goals(), np.zeros(len(self.servos))
        self.data.qpos[self.places], self.data.qvel[self.dofs] = self.goal, 0.0
        mujoco.mj_step1(self.model, self.data)

    def goals(self) -> Any:
        """Return where the servos take their joints [rad], shape (J,)."""
        return np.array([servo.joint_angle for servo in self.servos])

    def loads(self) -> Any:
        """Return what pulls at the servos [N m], as they count: weight, and what the arm meets."""
        still, weight = self.still, np.zeros(self.model.nv)
        still.qpos[:] = self.data.qpos
        mujoco.mj_kinematics(self.model, still)
        mujoco.mj_comPos(self.model, still)
        mujoco.mj_rne(self.model, still, 0, weight)
        return self.sign * (self.push - weight[self.dofs])

    def settle(self) -> None:
        """Take up what the command asks for in no time; nothing does when a replay begins."""
        self.commands.note(self.time, self.command)
        if self.time > 0.0:
            for d, (servo, load) in enumerate(zip(self.servos, self.loads(), strict=True)):
                servo.follow(float(self.commands.at(servo.clock(self.time))[d]), 0.0, load)

    def step(self) -> None:
        """Advance by the model's time step."""
        h = self.model.opt.timestep
        self.settle()
        for d, (servo, load) in enumerate(zip(self.servos, self.loads(), strict=True)):
            begin, end = servo.clock(self.time), servo.clock(self.time + h)
            servo.follow(self.commands.mean(d, begin, end), h, load)
        self.hold(h)
        mujoco.mj_step2(self.model, self.data)
        self.push += self.ease * (self.data.qfrc_constraint[self.dofs] - self.push)
        self.time += h
        mujoco.mj_step1(self.model, self.data)

    def hold(self, h: float) -> None:
        """Give the joints the torques that take them where their servos are after a step [s]."""
        data, goal = self.data, self.goals()
        rate = (goal - self.goal) / h
        missed = self.goal - data.qpos[self.places]
        missed_rate = self.rate - data.qvel[self.dofs]
        wanted, torque = np.zeros(self.model.nv), np.zeros(self.model.nv)
        wanted[self.dofs] = (rate - self.rate) / h
        wanted[self.dofs] += BANDWIDTH * (2.0 * missed_rate + BANDWIDTH * missed)
        mujoco.mj_mulM(self.model, data, torque, wanted)
        torque += data.qfrc_bias - data.qfrc_passive
        data.qfrc_applied[self.dofs] = torque[self.dofs]
        self.goal, self.rate = goal, rate

    def read(self) -> Any:
        """Return what the encoders report [rad], shape (J,).

        That is where the servos are, as far as nothing holds their joints off.
        """
        self.settle()
        away = self.data.qpos[self.places] - self.goal
        return self.sign * (self.goals() + away - [servo.zero for servo in self.servos])

    # ---- a recording

    def begin(
        self, command: Any, voltage: float, enabled: float, rows: dict[str, Any], step: float
    ) -> None:
        """Begin a replay of `rows`, whose `start` has measured angles [rad]."""
        self.model.opt.timestep = step
        self.reset(command, rows.get("start"))

    def ask(self, command: Any, voltage: float, enabled: float) -> None:
        """Tell the servos where to be [rad]."""
        self.command[:] = command

    def report(self) -> tuple[Any, ...]:
        """Return angles [rad], rates [rad/s], loads [N m] and joints [rad], as `replay` does."""
        angles = self.read()
        return angles, self.sign * self.rate, self.loads(), self.data.qpos[self.places]

    def advance(self, step: float, count: int) -> None:
        """Take so many steps [s]."""
        self.model.opt.timestep = step
        for _ in range(count):
            self.step()


def make_hook(model: Any, data: Any) -> ArmHook:
    """Return the hook of a MuJoCo model that holds the exported bodies and joints."""
    return ArmHook(model, data)


def make() -> ArmHook:
    """Return the hook of the model beside the program."""
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "arm.xml"))
    return make_hook(model, mujoco.MjData(model))
