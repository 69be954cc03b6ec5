"""A hand, and what lies in it, moved by MuJoCo and pulled by strings.

Bodies, joints, springs, stops and contacts are MuJoCo's. The scene's file is what `tendon-newton
asset export` writes of the asset of the same name; a unit has other masses, springs and friction.
"""

import importlib
from collections.abc import Sequence
from math import cos, sin
from pathlib import Path
from typing import Any

from tendon_hardware.virtual_bench.physics.constants import HandBallConstants, HandConstants
from tendon_newton.errors import MissingDependency

SCENES = Path(__file__).parents[1] / "scenes"  # Folder of the scenes' files
CUP = "obstacle"  # What the names of the cup's geoms begin with
TIP = "index_tip"
Pose = tuple[float, ...]  # Place [m] and quaternion (x, y, z, w)


def import_mujoco() -> Any:
    """Return the package, which is large and not needed by what is really there.

    Raises:
        MissingDependency: The package is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "a virtual hand needs the package 'mujoco', which is not installed; "
            "pip install 'tendon-newton[sim]'"
        ) from error


class Scene:
    """Fingers between their springs and strings, in front of what they touch.

    The strings' pulls are explicit: a string of 18 kN/m on the lightest link rings at 0.1 kHz,
    which a substep of 0.25 ms follows.

    Args:
        bench: Name of the scene's file.
        constants: What this unit has of the asset's numbers.
    """

    def __init__(self, bench: str, constants: HandConstants) -> None:
        self._mujoco = mujoco = import_mujoco()
        self._model = model = mujoco.MjModel.from_xml_path(str(SCENES / f"{bench}.xml"))
        self._data = data = mujoco.MjData(model)
        model.actuator_ctrllimited[:] = 0  # what a string takes is the spool's business
        self._joints = int((model.jnt_type != mujoco.mjtJoint.mjJNT_FREE).sum())
        self._fit(constants)
        weights = model.body_invweight0.copy(), model.dof_invweight0.copy()
        mujoco.mj_setConst(model, data)
        # contacts and stops stay as stiff as the asset says: MuJoCo's are the stiffer, the heavier
        model.body_invweight0[:], model.dof_invweight0[:] = weights
        mujoco.mj_resetData(model, data)
        mujoco.mj_step1(model, data)
        self._open: list[float] = data.ten_length.tolist()  # [m] with straight fingers
        self.excursions: tuple[float, ...]  # Line given to each string [m]
        self.excursion_rates: tuple[float, ...]  # [m/s]
        self._measure()

    def advance(
        self, pulls: Sequence[float], stiffnesses: Sequence[float], time_step: float
    ) -> None:
        """Advance by one substep [s] under each string's pull [N]."""
        model, data, mujoco = self._model, self._data, self._mujoco
        model.opt.timestep = time_step
        data.ctrl[:] = pulls
        mujoco.mj_step2(model, data)
        mujoco.mj_step1(model, data)
        self._measure()

    def place(self, joints: Sequence[float]) -> None:
        """Put the fingers at rest in a posture [rad]."""
        self._data.qpos[: self._joints] = joints
        self._data.qvel[: self._joints] = 0.0
        self._mujoco.mj_step1(self._model, self._data)
        self._measure()

    def tip(self) -> tuple[float, float]:
        """Return the index finger's tip, x and z in the base frame [m]."""
        x, _, z = self._data.site(TIP).xpos.tolist()
        return x, z

    def joints(self) -> tuple[float, ...]:
        """Return all joint angles, finger by finger [rad]."""
        return tuple(self._data.qpos[: self._joints].tolist())

    def ball(self) -> Pose | None:
        """Return where the ball is in the base frame, where there is one."""
        if self._joints == self._model.njnt:
            return None
        x, y, z, qw, qx, qy, qz = self._data.qpos[self._joints :].tolist()
        return x, y, z, qx, qy, qz, qw

    def put_back(self) -> None:
        """Lay the ball where it starts, at rest."""
        joints, model, data = self._joints, self._model, self._data
        data.qpos[joints:] = model.qpos0[joints:]
        data.qvel[joints:] = 0.0
        self._mujoco.mj_step1(model, data)

    def throw(self, velocity: Sequence[float]) -> None:
        """Give the ball a velocity [m/s], shape (3,), as a blow would."""
        self._data.qvel[self._joints : self._joints + 3] = velocity
        self._mujoco.mj_step1(self._model, self._data)

    def energy(self) -> float:
        """Return the energy of motion, weight and springs [J]."""
        model, data, mujoco = self._model, self._data, self._mujoco
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        return float(data.energy.sum())

    def _measure(self) -> None:
        """Take the strings' lengths where the links are now."""
        lengths, rates = self._data.ten_length.tolist(), self._data.ten_velocity.tolist()
        self.excursions = tuple(
            straight - length for straight, length in zip(self._open, lengths, strict=True)
        )
        self.excursion_rates = tuple(-rate for rate in rates)

    def _fit(self, c: HandConstants) -> None:
        """Give the scene the unit's numbers."""
        model = self._model
        fingers = [name.split("_")[0] for name in self._names("actuator")]
        for finger, mass, stiffness, damping in zip(
            fingers, c.masses, c.stiffness, c.damping, strict=True
        ):
            for place, name in enumerate(self._names("body")):
                if name.startswith(f"{finger}_"):
                    model.body_mass[place] *= mass
                    model.body_inertia[place] *= mass
            for place, name in enumerate(self._names("joint")):
                if name.startswith(f"{finger}_"):
                    model.jnt_stiffness[place] *= stiffness
                    model.dof_damping[model.jnt_dofadr[place]] *= damping
        x, _, z = model.opt.gravity.tolist()
        model.opt.gravity[0] = x * cos(c.tilt) - z * sin(c.tilt)
        model.opt.gravity[2] = x * sin(c.tilt) + z * cos(c.tilt)
        if isinstance(c, HandBallConstants):
            self._fit_ball(c)

    def _fit_ball(self, c: HandBallConstants) -> None:
        """Give ball and cup the unit's numbers; the smoother of two decides their friction."""
        model, geoms = self._model, self._names("geom")
        ball = model.jnt_bodyid[self._joints]
        model.body_mass[ball] *= c.ball_mass
        model.body_inertia[ball] *= c.ball_mass
        for pair in range(model.npair):
            first, second = int(model.pair_geom1[pair]), int(model.pair_geom2[pair])
            smooth = geoms[first].startswith(CUP) or geoms[second].startswith(CUP)
            model.pair_friction[pair, :2] *= c.cup_friction if smooth else c.ball_friction

    def _names(self, kind: str) -> list[str]:
        """Return the names of all bodies, joints, geoms or actuators."""
        model = self._model
        count = {"body": "nbody", "joint": "njnt", "geom": "ngeom", "actuator": "nu"}[kind]
        return [str(getattr(model, kind)(k).name) for k in range(getattr(model, count))]


class Still:
    """Strings that nothing gives line to, as while masses hang on the load cells."""

    def __init__(self, count: int) -> None:
        self.excursions = self.excursion_rates = (0.0,) * count

    def advance(
        self, pulls: Sequence[float], stiffnesses: Sequence[float], time_step: float
    ) -> None:
        """Stay."""

    def tip(self) -> None:
        """Return nothing: there is no tip."""
        return None
