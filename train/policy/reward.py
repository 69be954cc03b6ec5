r"""What a policy is paid for each step.

.. math:: r = -w_g \lVert p_{goal} - p_{tip} \rVert - w_s \lvert a_t - a_{t-1} \rvert
    - w_v (r \dot\theta)^2 - w_e a_t^2

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), eq. 8, for the first
two terms; their code has the others, and squares the change of the action.
"""

from __future__ import annotations

from torch import Tensor

from train.policy.environment_config import EnvironmentConfig


def step_reward(
    config: EnvironmentConfig,
    *,
    tip_error: Tensor,
    action: Tensor,
    action_change: Tensor,
    tendon_speed: Tensor,
) -> Tensor:
    """Return the reward of a step, shape (W,).

    Args:
        config: Its weights are the prices.
        tip_error: Distance between tip and goal after the step [m].
        action: Action applied [rad].
        action_change: Against the step before [rad].
        tendon_speed: Of the wound tendon [m/s].
    """
    price = config.goal_weight * tip_error + config.smooth_weight * action_change.abs()
    if config.tendon_speed_weight:
        price = price + config.tendon_speed_weight * tendon_speed.square()
    if config.effort_weight:
        price = price + config.effort_weight * action.square()
    return -price
