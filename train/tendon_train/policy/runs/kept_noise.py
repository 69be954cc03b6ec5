"""Exploration that goes on for some steps, so that fingers get somewhere by it."""

from math import sqrt
from typing import Any

import torch
from rsl_rl.modules.distribution import GaussianDistribution
from torch import Tensor


class KeptNoise(GaussianDistribution):
    r"""Gaussian actions whose noise keeps a share :math:`m` of itself from step to step.

    .. math:: a_t = \mu_t + \sigma n_t, \quad n_t = m n_{t-1} + \sqrt{1 - m^2}\, \epsilon_t

    Each action alone has the given deviation, by which PPO judges it.

    Source: Hollenstein et al., Colored Noise in PPO (2024), whose noise has another spectrum.

    Args:
        memory: Share kept [1].
    """

    def __init__(self, output_dim: int, memory: float, **settings: Any) -> None:
        super().__init__(output_dim, **settings)
        self._memory = memory
        self._noise: Tensor | None = None

    def forget(self) -> None:
        """Let the noise begin anew."""
        self._noise = None

    def sample(self) -> Tensor:
        """Return actions; only those of acting, which needs no gradient, move the noise on."""
        if torch.is_grad_enabled():
            return super().sample()
        fresh = torch.randn_like(self.mean)
        kept, new = self._memory, sqrt(1.0 - self._memory**2)
        self._noise = fresh if self._noise is None else kept * self._noise + new * fresh
        return self.mean + self.std * self._noise
