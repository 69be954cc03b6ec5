"""A differentiable rollout as one step of a torch program."""

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from tendon_newton.errors import unknown_name
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.taped_run import READINGS
from tendon_newton.simulation.hosts.torch_bridge import plain_tensor


@dataclass(frozen=True, kw_only=True)
class TrajectoryTensors:
    """What a rollout reads in all rows S of its recordings, with gradients."""

    joint_position: Tensor  # Joint positions [rad, m], shape (S, J)
    motor_position: Tensor  # Angle that the encoder reports [rad], shape (S, D)
    motor_velocity: Tensor  # Rate of the motor angle [rad/s], shape (S, D)
    force: Tensor  # Tension at the load cell [N], shape (S, D)


def simulate_with_gradients(
    rollout: DifferentiableRollout,
    *,
    parameters: Tensor | None = None,
    command: Tensor | None = None,
    **bench: Tensor,
) -> TrajectoryTensors:
    """Simulate recordings; `backward` on what comes out reaches all that went in.

    Also the weights of the rollout's network, if it has one. What is not given stays as it is in
    `rollout.inputs`.

    Args:
        rollout: The recordings, with the kernels that walk them back.
        parameters: Numbers of actuator and effects, shape (W, P); `rollout.table` says where each
            stands.
        command: Motor angles asked for in all rows [rad], shape (S, D).
        **bench: Numbers of the mechanism by name, such as ``stiffness`` [N m/rad] (W, J).

    Raises:
        UnknownName: No such number carries a gradient.
        SimulationDiverged: A state is not finite.
    """
    given: dict[str, Tensor] = dict(bench)
    for name in bench:
        if name not in rollout.bench_names:
            raise unknown_name("differentiable number", name, rollout.bench_names)
    if parameters is not None:
        given["parameters"] = parameters
    if command is not None:
        given["command"] = command
    out = TrajectoryFunction.apply(rollout, tuple(given), *given.values(), *rollout.weights)
    return TrajectoryTensors(**dict(zip(READINGS, out, strict=True)))


class TrajectoryFunction(torch.autograd.Function):
    """Runs a rollout forwards and backwards for torch's autograd.

    The states live in the rollout: where another run has overwritten them, backward runs again.
    """

    @staticmethod
    def forward(
        ctx: Any, rollout: DifferentiableRollout, names: tuple[str, ...], *tensors: Tensor
    ) -> tuple[Tensor, ...]:
        """Write the inputs, simulate, and return the readings."""
        ctx.rollout, ctx.names = rollout, names
        ctx.save_for_backward(*tensors)
        write_inputs(rollout, names, tensors)
        readings = rollout.forward()
        ctx.run = rollout.run_count
        return tuple(plain_tensor(getattr(readings, name)).clone() for name in READINGS)

    @staticmethod
    def backward(ctx: Any, *seeds: Tensor | None) -> tuple[Tensor | None, ...]:
        """Walk the rollout back, and return the gradients of the inputs."""
        rollout, names = ctx.rollout, ctx.names
        tensors = ctx.saved_tensors
        if rollout.run_count != ctx.run:
            write_inputs(rollout, names, tensors)
            rollout.forward()
            ctx.run = rollout.run_count
        arrays = {
            n: s.contiguous().cpu().numpy()
            for n, s in zip(READINGS, seeds, strict=True)
            if s is not None
        }
        rollout.backward(**arrays)
        found = [
            plain_tensor(input_array(rollout, name).grad).reshape(tensor.shape).to(tensor).clone()
            for name, tensor in zip(names, tensors, strict=False)
        ]
        return (None, None, *found, *rollout.weight_gradients)


def input_array(rollout: DifferentiableRollout, name: str) -> Any:
    """Return the array behind the name of an input."""
    owner = rollout.inputs if name in ("parameters", "command") else rollout.inputs.mechanism
    return getattr(owner, name)


def write_inputs(
    rollout: DifferentiableRollout, names: tuple[str, ...], tensors: tuple[Tensor, ...]
) -> None:
    """Write tensors to the arrays of the same names; the network's weights are its own."""
    for name, tensor in zip(names, tensors, strict=False):
        target = plain_tensor(input_array(rollout, name))
        target.copy_(tensor.detach().reshape(target.shape))
