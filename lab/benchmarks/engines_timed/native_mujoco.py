"""MuJoCo with a fixed tendon and an actuator of its own, in three bodies: Newton's, Warp's, C's.

The finger is the MJCF that `tendon-newton` exports; the servo is an affine actuator on the tendon,
so that no kernel of ours runs between two steps.
"""

from __future__ import annotations

import tempfile
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, ClassVar

import mujoco
import mujoco_warp
import newton
import numpy as np
import warp as wp
from newton.solvers import SolverMuJoCo

from lab.benchmarks.engines_timed.engines import (
    CAPPED,
    FORCE_LIMIT,
    GAIN,
    JOINT_FRICTION,
    RADIUS,
    SPRING_STOPS,
    STICKING_FRICTION,
    MujocoEngine,
    SwingingEngine,
    even_substeps,
    rest,
    rubbing,
)
from lab.benchmarks.engines_timed.soundness import CONTROL_STEP
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model

MOST_CONSTRAINTS = 4  # Two joints that rub, two stops


def finger_spec(friction: float, *, servo: bool = True) -> Any:
    """Return the exported finger with dry friction [N m] and an actuator on its tendon.

    The control is the ideal source's command [rad], or without a servo the tension [N].
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "finger.xml"
        write_mujoco(file, load_mechanism("finger"))
        spec = mujoco.MjSpec.from_file(str(file))
    for joint, stop in zip(spec.joints, stops(), strict=True):
        joint.frictionloss = friction
        joint.solimp_friction = STICKING_FRICTION
        joint.solimp_limit, joint.solref_limit = SPRING_STOPS, stop
    if servo:
        (actuator,) = spec.actuators
        actuator.gainprm[0], actuator.biasprm[1] = GAIN, -GAIN / RADIUS
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        actuator.ctrllimited, actuator.forcelimited = 0, 1
        actuator.forcerange = [0.0, FORCE_LIMIT]
    spec.option.iterations, spec.option.ls_iterations = CAPPED.values()
    return spec


@cache
def stops() -> list[np.ndarray]:
    """Return MuJoCo's `solref` of each end stop, as Newton makes it of the asset's springs."""
    model = rubbing(build_model(load_mechanism("finger"), 1, device="cpu"), 0.0)
    solver: Any = SolverMuJoCo(model, disable_contacts=True)
    return list(solver.mj_model.jnt_solref)


@lru_cache(maxsize=1)
def native_fingers(worlds: int, friction: float) -> newton.Model:
    """Return so many fingers, read by Newton from that MJCF."""
    one, all_of_them = newton.ModelBuilder(), newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(one)
    spec = finger_spec(friction)
    spec.compile()
    one.add_mjcf(spec.to_xml())
    all_of_them.replicate(one, worlds)
    return all_of_them.finalize()


class NativeMujocoEngine(MujocoEngine):
    """SolverMuJoCo, the servo inside MuJoCo."""

    def make_model(self, worlds: int, friction: float) -> Any:
        """Return the fingers."""
        return native_fingers(worlds, friction)

    def make_command(self, worlds: int) -> wp.array:
        """Return MuJoCo's own controls, shape (W, 1)."""
        return self.control.mujoco.ctrl.reshape((worlds, 1))

    def pull(self, state: Any) -> None:
        """Do nothing: MuJoCo pulls."""


class WarpMujocoEngine(SwingingEngine):
    """`mujoco_warp.step` and nothing around it."""

    has_servo: ClassVar[bool] = True
    """Whether its control is a motor angle [rad]; else it is the tension [N]."""

    def __init__(self, worlds: int, step: float, *, friction: float = JOINT_FRICTION) -> None:
        spec = finger_spec(friction, servo=self.has_servo)
        self.substeps = even_substeps(step)
        spec.option.timestep = CONTROL_STEP / self.substeps
        compiled = spec.compile()
        self.model: Any = mujoco_warp.put_model(compiled)
        self.model.opt.warn_overflow = 0
        self.data: Any = mujoco_warp.make_data(compiled, nworld=worlds, njmax=MOST_CONSTRAINTS)
        self.command = self.data.ctrl
        self.settle()
        self.record()

    def settle(self) -> None:
        """Put all fingers at rest."""
        self.data.qpos.assign(np.tile(rest(), (len(self.command), 1)))
        self.data.qvel.zero_()
        self.data.qacc_warmstart.zero_()

    def control_step(self) -> None:
        """Hold the command for one control step."""
        for _ in range(self.substeps):
            mujoco_warp.step(self.model, self.data)

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        return self.data.qpos.numpy()

    def coordinates(self) -> tuple[wp.array, wp.array]:
        """Return where joint angles [rad] and rates [rad/s] are, shape (2 W,)."""
        return self.data.qpos.flatten(), self.data.qvel.flatten()


class PlainMujocoEngine(SwingingEngine):
    """MuJoCo itself, in C and float64, on one core: one call per world and control step."""

    def __init__(self, worlds: int, step: float, *, friction: float = JOINT_FRICTION) -> None:
        spec = finger_spec(friction)
        self.substeps = even_substeps(step)
        spec.option.timestep = CONTROL_STEP / self.substeps
        self.model = spec.compile()
        self.data = [mujoco.MjData(self.model) for _ in range(worlds)]
        self.command = wp.zeros((worlds, 1), dtype=float)
        self.record()

    def settle(self) -> None:
        """Put all fingers at rest."""
        for data in self.data:
            mujoco.mj_resetData(self.model, data)
            data.qpos[:] = rest()

    def control_step(self) -> None:
        """Do nothing: the graph holds the commands alone."""

    def run(self) -> None:
        """Do one control step."""
        super().run()
        commands = self.command.numpy()[:, 0]
        for data, command in zip(self.data, commands, strict=True):
            data.ctrl[0] = command
            mujoco.mj_step(self.model, data, self.substeps)

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        return np.array([data.qpos for data in self.data])
