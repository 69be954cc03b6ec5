"""Fingers under a force network that is asked once per control step: ours, and MuJoCo's."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import torch
import warp as wp

from lab.benchmarks.engines_timed.engines import (
    FORCE_LIMIT,
    JOINT_FRICTION,
    RADIUS,
    START,
    MujocoEngine,
    Swing,
    rest,
)
from lab.benchmarks.engines_timed.native_mujoco import WarpMujocoEngine
from tendon_newton.actuators.networks.history import History, push_sample
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_newton.simulation.hosts.torch_bridge import Graph, torch_stream
from tests.physics.learned.networks import learned_model


@wp.kernel
def held_pull_kernel(
    held: wp.array2d(dtype=float), arms: wp.array(dtype=float), force: wp.array(dtype=float)
) -> None:
    """Apply forces that are held for a control step to the two joints of a finger."""
    i = wp.tid()
    pull = wp.clamp(held[i, 0], 0.0, FORCE_LIMIT)
    force[2 * i] = arms[2 * i] * pull
    force[2 * i + 1] = arms[2 * i + 1] * pull


@wp.kernel
def sample_kernel(
    command: wp.array2d(dtype=float),
    arms: wp.vec2f,
    q: wp.array(dtype=float),
    v: wp.array(dtype=float),
    fill: int,
    ring: wp.array3d(dtype=float),
    newest: wp.array(dtype=int),
) -> None:
    """Add what a force network is shown to its history."""
    i = wp.tid()
    angle = (arms[0] * q[2 * i] + arms[1] * q[2 * i + 1]) / RADIUS
    rate = (arms[0] * v[2 * i] + arms[1] * v[2 * i + 1]) / RADIUS
    push_sample(ring, newest, i, wp.vec3f(command[i, 0], angle, rate), fill)


class HeldMujocoEngine(MujocoEngine):
    """SolverMuJoCo whose command is a tension [N]."""

    def pull(self, state: Any) -> None:
        """Apply the tension that is held."""
        inputs = [self.command, self.model.tendon.arm_coef, self.control.joint_f]
        wp.launch(held_pull_kernel, len(self.command), inputs=inputs)


class HeldWarpMujocoEngine(WarpMujocoEngine):
    """`mujoco_warp` whose control is a tension [N]."""

    has_servo: ClassVar[bool] = False


class NetworkEngine:
    """MuJoCo under a force network.

    On CUDA, torch's and Warp's launches of a control step are one graph; on a CPU the mechanics
    are.
    """

    kind: ClassVar[type[HeldMujocoEngine | HeldWarpMujocoEngine]]

    def __init__(self, worlds: int, step: float, *, query: ForceQuery) -> None:
        device = wp.get_device()
        self.mechanics = self.kind(worlds, step)
        self.arms = wp.vec2f(*load_mechanism("finger").tendons[0].moment_arm)
        self.command = wp.zeros((worlds, 1), dtype=float)
        self.swing = Swing(self.command)
        self.history = History(worlds, query.window, device)
        self.query = query
        self._whole = Graph(self._control_step, device, enabled=device.is_cuda)
        self._simulate = Graph(self.mechanics.control_step, device, enabled=not device.is_cuda)

    def begin(self) -> None:
        """Put all fingers at rest, as if they had always been there, and swings at the start."""
        self.command.fill_(START)
        self.swing.begin()
        self.mechanics.settle()
        self._sample(fill=True)

    def run(self) -> None:
        """Do one control step."""
        self._whole()

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, 2)."""
        return self.mechanics.joints()

    def _control_step(self) -> None:
        self.swing()
        self._sample(fill=False)
        self.query(self.history, self.mechanics.command.flatten())
        self._simulate()

    def _sample(self, *, fill: bool) -> None:
        """Show the network the present."""
        inputs = [self.command, self.arms, *self.mechanics.coordinates(), int(fill)]
        inputs += [self.history.ring, self.history.newest]
        wp.launch(sample_kernel, len(self.command), inputs=inputs)


class MujocoNetworkEngine(NetworkEngine):
    """SolverMuJoCo under a force network."""

    kind = HeldMujocoEngine


class WarpMujocoNetworkEngine(NetworkEngine):
    """`mujoco_warp` under a force network."""

    kind = HeldWarpMujocoEngine


class LoopEngine:
    """Our control loop: sensors, network, mechanics, readings."""

    def __init__(
        self, worlds: int, step: float, *, query: ForceQuery, precision: Any = "float32"
    ) -> None:
        self.device = wp.get_device()
        self.loop = ControlLoop(
            load_mechanism("finger"),
            learned_model(),
            worlds,
            max_step=step,
            precision=precision,
            query=query,
            device=self.device,
        )
        self.loop.bench_numbers("friction").fill_(JOINT_FRICTION)
        self.command = torch.full((worlds, 1), START, device=wp.device_to_torch(self.device))
        self.swing = Swing(wp.from_torch(self.command))

    def begin(self) -> None:
        """Put all fingers at rest, as if they had always been there, and swings at the start."""
        self.command.fill_(START)
        self.swing.begin()
        joints = torch.tensor(rest()).to(self.command).expand(len(self.command), -1)
        self.loop.reset(self.command, joint_position=joints)

    def run(self) -> None:
        """Do one control step."""
        with torch_stream(self.device):
            self.swing()
        self.loop.step(self.command)

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], NaN where the loop has stopped a world, (W, 2)."""
        reading = self.loop.reading
        joints = torch.where(reading.diverged[:, None], torch.nan, reading.joint_position)
        return joints.cpu().numpy()
