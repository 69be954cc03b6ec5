"""One bench of an export to MuJoCo, stepped as its user would, without any of this project."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

SWING_IN = 4.0
"""How long [s] a file alone swings in under its first command; the program knows its rest."""


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What a world is made of."""

    folder: Path  # The export
    way: str  # A key of `WAYS`
    step: float  # Step [s]
    tip_body: int  # MuJoCo's number of the link with the tip
    tip_point: tuple[float, ...]  # The tip in the frame of that link [m]

    def tip(self, data: Any) -> Any:
        """Return the tip in the base frame [m], shape (3,)."""
        turned = data.xmat[self.tip_body].reshape(3, 3) @ self.tip_point
        return data.xpos[self.tip_body] + turned


class ProgramWorld:
    """`model.xml`, stepped by `tendon_step.py`."""

    def __init__(self, bench: Bench) -> None:
        path = bench.folder / "tendon_step.py"
        spec: Any = importlib.util.spec_from_file_location("tendon_step", path)
        program = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(program)
        model = mujoco.MjModel.from_xml_path(str(bench.folder / "model.xml"))
        model.opt.timestep = bench.step
        self.hook, self.bench = program.make_hook(model, mujoco.MjData(model)), bench

    def reset(self, command: Any) -> None:
        """Begin at rest under a command [rad], shape (D,)."""
        self.hook.reset(command)

    def advance(self, command: Any, count: int) -> None:
        """Hold a command [rad] for some steps."""
        self.hook.command[:] = command
        for _ in range(count):
            self.hook.step()

    def read(self) -> Any:
        """Return angles [rad], speeds [rad/s], forces [N], joints, their rates and the tip [m]."""
        seen, data = self.hook.read(), self.hook.data
        joints = [data.qpos[self.hook.places], data.qvel[self.hook.dofs]]
        return np.concatenate(
            [seen.angle, seen.angle_rate, seen.force, *joints, self.bench.tip(data)]
        )


class FileWorld:
    """`model.xml` and nothing else."""

    def __init__(self, bench: Bench) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(bench.folder / "model.xml"))
        self.model.opt.timestep = bench.step
        self.data, self.bench = mujoco.MjData(self.model), bench
        names = [self.model.joint(k).name for k in range(self.model.njnt)]
        self.joints = [k for k, name in enumerate(names) if not name.endswith("_spool")]

    def reset(self, command: Any) -> None:
        """Swing in without dry friction under a command [rad], shape (D,)."""
        mujoco.mj_resetData(self.model, self.data)
        frictions = (self.model.tendon_frictionloss, self.model.dof_frictionloss)
        kept = [friction.copy() for friction in frictions]
        for friction in frictions:
            friction[:] = 0.0
        self.advance(command, round(SWING_IN / self.model.opt.timestep))
        for friction, lost in zip(frictions, kept, strict=True):
            friction[:] = lost

    def advance(self, command: Any, count: int) -> None:
        """Hold a command [rad] for some steps."""
        self.data.ctrl[:] = command
        mujoco.mj_step(self.model, self.data, nstep=count)

    def read(self) -> Any:
        """Return angles [rad], speeds [rad/s], forces [N], joints, their rates and the tip [m].

        The length of an exported actuator is the motor's angle. A string behind a rotor has a
        sensor of its tension.
        """
        mujoco.mj_forward(self.model, self.data)
        data = self.data
        force = data.actuator_force * np.abs(self.model.actuator_gear[:, 0])
        force = data.sensordata if self.model.nsensor else force
        seen = [data.actuator_length, data.actuator_velocity, force]
        joints = [data.qpos[self.joints], data.qvel[self.joints]]
        return np.concatenate([*seen, *joints, self.bench.tip(data)])


WAYS = {"program": ProgramWorld, "file": FileWorld}


def serve(pipe: Any, bench: Bench, count: int) -> None:
    """Hold some worlds in a process of their own and answer until the pipe closes.

    Args:
        pipe: Takes (commands, shape (N, D), steps), or (commands, mask of the worlds to reset).
        bench: What each world is.
        count: Number of worlds N.
    """
    worlds = [WAYS[bench.way](bench) for _ in range(count)]
    while True:
        try:
            commands, told = pipe.recv()
        except EOFError:
            return
        for k, (world, command) in enumerate(zip(worlds, commands, strict=True)):
            if isinstance(told, int):
                world.advance(command, told)
            elif told[k]:
                world.reset(command)
        pipe.send(np.array([world.read() for world in worlds]))
