"""What the hands of an environment are for: a goal, what is seen besides servos, what is paid."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from tendon_train.policy.config.environment_config import EnvironmentConfig


def step_reward(
    config: EnvironmentConfig,
    *,
    tip_error: Tensor,
    action: Tensor,
    action_change: Tensor,
    tendon_speed: Tensor,
) -> Tensor:
    r"""Return the reward of a step, shape (W,).

    .. math:: r = -w_g \lVert p_{goal} - p_{tip} \rVert - \sum_d ( w_s \lvert a_t - a_{t-1} \rvert
        + w_v (\rho \dot\theta)^2 + w_e a_t^2 )

    with the sum over the servos; :math:`\rho` is the radius of a spool. Source: Yuryev and Hughes,
    Tendon Force Modeling for Sim2Real Transfer (2026), eq. 8, for the first two terms; their code
    has the others, and squares the change of the action.

    Args:
        tip_error: Distance between tip and goal after the step [m].
        action: Actions applied [rad], shape (W, D).
        action_change: Against the step before [rad], shape (W, D).
        tendon_speed: Speed of the wound tendons [m/s], shape (W, D).
    """
    price = config.goal_weight * tip_error
    return -with_work(
        config, price, action=action, action_change=action_change, tendon_speed=tendon_speed
    )


def with_work(
    config: EnvironmentConfig,
    price: Tensor,
    *,
    action: Tensor,
    action_change: Tensor,
    tendon_speed: Tensor,
) -> Tensor:
    """Return a price, (W,), with what the work of the servos costs; arguments as above."""
    price = price + config.smooth_weight * action_change.abs().sum(dim=-1)
    if config.tendon_speed_weight:
        price = price + config.tendon_speed_weight * tendon_speed.square().sum(dim=-1)
    if config.effort_weight:
        price = price + config.effort_weight * action.square().sum(dim=-1)
    return price


@dataclass(frozen=True, kw_only=True)
class TaskOutcome:
    """What a step has brought."""

    reward: Tensor  # Shape (W,)
    # Worlds whose episode ends by a failure, shape (W,), where a task knows any
    failed: Tensor | None
    # Means over all worlds for the learning curve, by the names of `CURVE_FIGURES`
    log: Mapping[str, Tensor]


class Task(Protocol):
    """A task of W hands.

    A new episode calls `place` before its worlds are reset and `begin` after that. A step calls
    `score`, then `renew`.
    """

    goal: Tensor  # What is asked for: angles [rad] or rates [rad/s], shape (W,)
    # Greatest command at the start of an episode [rad], where the servos have a greater one
    greatest_start: float

    def place(self, worlds: Tensor) -> dict[str, Tensor]:
        """Draw what stands in some worlds, a mask, and return what else their reset is given."""
        ...

    def begin(self, worlds: Tensor) -> None:
        """Give goals to episodes that begin."""
        ...

    def score(self, *, action: Tensor, action_change: Tensor, tendon_speed: Tensor) -> TaskOutcome:
        """Judge a step.

        Args:
            action: Actions applied [rad], shape (W, D).
            action_change: Against the step before [rad], shape (W, D).
            tendon_speed: Speed of the wound tendons [m/s], shape (W, D).
        """
        ...

    def renew(self, ended: Tensor) -> None:
        """Change goals within episodes; those of worlds that have ended are drawn by `begin`."""
        ...

    def seen(self) -> tuple[Tensor, ...]:
        """Return what a policy sees behind the goal, shape (W, N); nothing of most tasks."""
        ...

    def hidden(self) -> Tensor | None:
        """Return what only the critic sees, shape (W, M), where there is something."""
        ...
