"""The motor cannot turn faster."""

import math

import warp as wp

from tendon_newton.effects.base import Effect, Parameter, Values, real


class SpeedLimit(Effect):
    r"""The motor's speed is bounded either way.

    .. math:: |\dot\theta| \le \omega

    Winding in, the tension falls as far as it takes; winding out, the motor holds what it takes.
    Source: back-EMF at full duty, or a profile velocity in the firmware.
    Validity: a sharp bound that does not depend on load; see viscous_friction for a soft one.
    Signature: large steps become ramps of one slope; slow motion is not touched.
    Confused with: viscous_friction and actuator_lag in steps of one size; steps of several sizes
    tell.
    """

    side = "actuator"
    confused = ("actuator_lag", "viscous_friction")
    parameters = (
        Parameter("limit", "rad/s", null=math.inf, nominal=8.0, lower=0.5, upper=100.0).since(
            "hobby servos turn at 3 to 12 rad/s"
        ),
    )

    @staticmethod
    def speed(limit: real, values: Values) -> real:
        """The lower of two bounds."""
        return wp.min(limit, values[0])
