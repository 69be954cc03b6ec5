r"""The reward of a policy for each step.

.. math:: r = -w_g \lVert p_{goal} - p_{tip} \rVert - \sum_d ( w_s \lvert a_t - a_{t-1} \rvert
    + w_v (\rho \dot\theta)^2 + w_e a_t^2 )

with the sum over the servos; :math:`\rho` is the radius of a spool.

Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), eq. 8, for the first
two terms; their code has the others, and squares the change of the action.
"""

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
    """Return the reward of a step, shape (W,).

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
