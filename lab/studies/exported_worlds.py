"""Many exported benches as the simulator of a policy's training, on some cores."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import multiprocessing
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import torch
from torch import Tensor

from lab.studies.exported_world import Bench, serve
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.control_loop import ControlReading


class ExportedWorlds:
    """W benches of an export to MuJoCo with `reset`, `step` and `reading` of a `ControlLoop`.

    Args:
        folder: The export.
        mechanism: The bench, for its tip.
        way: ``program`` for `tendon_step.py`, ``file`` for `model.xml` alone.
        worlds: How many.
        rate: Commands per second [Hz].
        step: Step [s].
        jobs: Processes.
    """

    def __init__(
        self,
        folder: Path,
        mechanism: Mechanism,
        way: str,
        worlds: int,
        *,
        rate: float,
        step: float,
        jobs: int = 1,
    ) -> None:
        self.drives, self.joints = len(mechanism.tendons), len(mechanism.joints)
        self.count = round(1.0 / (rate * step))
        self.shares = [len(part) for part in np.array_split(np.arange(worlds), jobs)]
        body, point = place_of_tip(folder, mechanism)
        bench = Bench(folder=folder, way=way, step=step, tip_body=body, tip_point=point)
        context = multiprocessing.get_context("spawn")
        self.pipes: list[Any] = []
        for share in self.shares:
            here, there = context.Pipe()
            context.Process(target=serve, args=(there, bench, share), daemon=True).start()
            there.close()
            self.pipes.append(here)
        rest = torch.zeros(worlds, self.drives)
        self.reading = self._asked(rest, np.zeros(worlds, dtype=bool))

    def reset(self, command: Tensor, worlds: Tensor) -> ControlReading:
        """Begin anew at rest under commands [rad], shape (W, D), in some worlds."""
        self.reading = self._asked(command, worlds.numpy())
        return self.reading

    def step(self, command: Tensor) -> ControlReading:
        """Hold commands [rad], shape (W, D), for one control step."""
        self.reading = self._asked(command, None)
        return self.reading

    def close(self) -> None:
        """End the processes."""
        for pipe in self.pipes:
            pipe.close()

    def _asked(self, command: Tensor, mask: Array | None) -> ControlReading:
        """Let all processes act, and read all worlds."""
        ends = np.cumsum(self.shares)[:-1]
        commands = np.split(command.double().numpy(), ends)
        masks = [self.count] * len(self.shares) if mask is None else np.split(mask, ends)
        for pipe, own, told in zip(self.pipes, commands, masks, strict=True):
            pipe.send((own, told))
        rows = np.concatenate([pipe.recv() for pipe in self.pipes])
        sizes = [self.drives, self.drives, self.drives, self.joints, self.joints]
        angle, rate, force, joints, rates, tips = np.split(rows, np.cumsum(sizes), axis=1)

        def tensor(values: Array) -> Tensor:
            return torch.tensor(np.nan_to_num(values), dtype=torch.float32)

        return ControlReading(
            motor_position=tensor(angle),
            motor_velocity=tensor(rate),
            force=tensor(force),
            joint_position=tensor(joints),
            joint_velocity=tensor(rates),
            tip=tensor(tips),
            diverged=torch.tensor(~np.isfinite(rows).all(axis=1)),
        )


def place_of_tip(folder: Path, mechanism: Mechanism) -> tuple[int, tuple[float, ...]]:
    """Return the tip's link in an exported file, and the tip in the frame of that link [m]."""
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert mechanism.tip is not None
    name = mechanism.joints[mechanism.tip.body].name
    body = int(model.jnt_bodyid[model.joint(name).id])
    places = [model.joint(joint.name).qposadr[0] for joint in mechanism.joints]
    tip = tip_position(mechanism, data.qpos[places])
    point = data.xmat[body].reshape(3, 3).T @ (tip - data.xpos[body])
    return body, tuple(float(x) for x in point)
