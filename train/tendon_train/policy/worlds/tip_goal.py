"""The task of a finger whose tip goes to moving goals."""

from math import inf

import torch
from torch import Tensor

from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.goal_path import GoalPath
from tendon_train.policy.worlds.task import TaskOutcome
from tendon_train.policy.worlds.world_draws import WorldDraws


class TipGoal:
    """Goal angles of the tip."""

    greatest_start = inf

    def __init__(
        self, config: EnvironmentConfig, loop: ControlLoop, path: GoalPath, draws: WorldDraws
    ) -> None:
        self._config, self._loop, self._draws = config, loop, draws
        self.path = path  # Goal points
        self.goal = torch.zeros(config.worlds, device=draws.device)  # Goal angles [rad], shape (W,)

    def place(self, worlds: Tensor) -> dict[str, Tensor]:
        """Place nothing: a finger begins where its servos are."""
        return {}

    def begin(self, worlds: Tensor) -> None:
        """Draw goals."""
        goals = self._goals_at(self._draws.uniform(worlds=worlds))
        self.goal.copy_(torch.where(worlds, goals, self.goal))

    def score(self) -> TaskOutcome:
        """Price the distance between tip and goal.

        Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), eq. 8, as for
        the price of actions that change.
        """
        tip_error = self.tip_error()
        reward = -self._config.goal_weight * tip_error
        return TaskOutcome(reward=reward, failed=None, log={"/tip_error_m": tip_error.mean()})

    def renew(self, ended: Tensor) -> None:
        """Give some of the worlds that go on a new goal."""
        chance, share = self._draws.uniform(2).unbind(dim=1)
        renewed = (chance < self._config.goal_change) & ~ended
        self.goal.copy_(torch.where(renewed, self._goals_at(share), self.goal))

    def seen(self) -> tuple[Tensor, ...]:
        """Return nothing: servos and goal are all."""
        return ()

    def hidden(self) -> Tensor | None:
        """Return nothing: the critic sees what the policy sees."""
        return None

    def tip_error(self) -> Tensor:
        """Return the distances between tips and goal points [m], shape (W,)."""
        tip = self._loop.reading.tip
        assert tip is not None
        return torch.linalg.vector_norm(self.path.points(self.goal) - tip, dim=-1)

    def _goals_at(self, share: Tensor) -> Tensor:
        """Return the goals [rad] at some shares of their range."""
        low, high = self._config.goals
        return low + (high - low) * share
