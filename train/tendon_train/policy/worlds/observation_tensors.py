"""The observations of W policies on their device, number for number those of deployment."""

import torch
from torch import Tensor

from tendon_newton.data.cards.policy_observation import HISTORY, Task, sample_of


class ObservationTensors:
    """The `ObservationHistory` of a policy for tensors that stay on a device.

    Args:
        worlds: Number of policies W.
        servos: Number of servos D of each.
        task: What they are for; behind its goal stand N numbers that are seen.
    """

    def __init__(
        self,
        worlds: int,
        history: int = HISTORY,
        device: torch.device | str = "cpu",
        servos: int = 1,
        task: Task = "tip",
    ) -> None:
        shape = (worlds, history, len(sample_of(servos, task)))
        self._samples = torch.zeros(shape, dtype=torch.float32, device=device)
        self._action = torch.zeros(worlds, servos, dtype=torch.float32, device=device)
        self._previous = torch.zeros_like(self._action)
        self._fresh = torch.ones(worlds, dtype=torch.bool, device=device)

    @property
    def action(self) -> Tensor:
        """Actions applied last [rad], shape (W, D)."""
        return self._action

    def reset(self, worlds: Tensor) -> None:
        """Forget what was seen and done in some worlds, a mask of shape (W,)."""
        self._action.masked_fill_(worlds[:, None], 0.0)
        self._previous.masked_fill_(worlds[:, None], 0.0)
        self._fresh.logical_or_(worlds)

    def observe(self, position: Tensor, velocity: Tensor, goal: Tensor, *seen: Tensor) -> None:
        """Enter motor angles [rad] and speeds [rad/s], (W, D), goals, (W,), and what is seen."""
        own = [position, velocity, self._action, self._previous]
        latest = torch.cat([*own, goal[:, None], *seen], dim=-1)
        later = torch.cat([self._samples[:, 1:], latest[:, None]], dim=1)
        self._samples.copy_(torch.where(self._fresh[:, None, None], latest[:, None], later))
        self._fresh.fill_(False)

    def act(self, action: Tensor) -> None:
        """Note the actions [rad] that are applied from now on, shape (W, D), already cut."""
        self._previous.copy_(self._action)
        self._action.copy_(action)

    def flat(self) -> Tensor:
        """Return the observations, shape (W, history * (4 D + 1 + N)), as a new tensor."""
        return self._samples.flatten(1).clone()
