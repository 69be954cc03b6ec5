"""A camera that sees where a body is: late, and with noise."""

from __future__ import annotations

import torch
from torch import Tensor

from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.worlds.world_draws import WorldDraws


class SimulatedCamera:
    """What W cameras give at each policy step; noise and delay differ by world and episode.

    Args:
        config: Ranges of noise and delay.
        worlds: Number of worlds W.
        draws: Source of all numbers, on the device of the worlds.
    """

    def __init__(self, config: TurningConfig, worlds: int, draws: WorldDraws) -> None:
        self._config, self._draws = config, draws
        kept = 1 + config.camera_delay[1]
        self._places = torch.zeros(worlds, kept, 3, device=draws.device)
        """Latest places [m], the newest first."""
        self._delay = torch.zeros(worlds, dtype=torch.long, device=draws.device)
        self._noise = torch.zeros(worlds, device=draws.device)

    def begin(self, worlds: Tensor, place: Tensor) -> None:
        """Draw noise and delay in some worlds, a mask, where a place (W, 3) was seen for long."""
        share, step = self._draws.uniform(2, worlds=worlds).unbind(dim=1)
        (low, high), (least, most) = self._config.camera_noise, self._config.camera_delay
        noise, delay = low + (high - low) * share, least + (step * (1 + most - least)).long()
        self._noise.copy_(torch.where(worlds, noise, self._noise))
        self._delay.copy_(torch.where(worlds, delay, self._delay))
        self._places.copy_(torch.where(worlds[:, None, None], place[:, None], self._places))

    def take(self, place: Tensor) -> None:
        """Note where bodies are now [m], shape (W, 3)."""
        self._places.copy_(torch.cat([place[:, None], self._places[:, :-1]], dim=1))

    def seen(self) -> Tensor:
        """Return what the cameras give [m], shape (W, 3)."""
        late = self._delay[:, None, None].expand(-1, 1, 3)
        noise = self._noise[:, None] * self._draws.normal(3)
        return self._places.gather(1, late).squeeze(1) + noise
