"""A gear that holds its load better than it drives it."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real
from tendon_newton.effects.loaded_gear import load_side


class HoldingFriction(Effect):
    r"""Friction in proportion to the load, but only while the load drives the gear backwards.

    .. math:: F = \frac{F_m}{1 - \eta} \text{ while } F_m v < 0,
        \qquad F \in \left[F_m, \frac{F_m}{1 - \eta}\right] \text{ at } v = 0

    Source: worm gears and high-ratio trains, whose efficiency is worse backwards than forwards, and
    which cannot be driven backwards at all as the share goes to one.
    Validity: a share that does not depend on load or speed.
    Signature: forces fit while winding in and stay too high while winding out and at rest after it.
    Confused with: load_dependent_friction, which also costs force while winding in; gain_error.
    """

    side = "actuator"
    confused = ("gain_error", "load_dependent_friction")
    dry = ("share",)
    parameters = (
        Parameter("share", "1", null=0.0, nominal=0.1, lower=0.0, upper=0.9).since(
            "at one the gear locks itself"
        ),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m / (1 - share) against a motion that the load drives."""
        driven_back = wp.max(-load_side(force[0], tendon), real(0.0))
        return force * (real(1.0) / (real(1.0) - values[0] * driven_back))
