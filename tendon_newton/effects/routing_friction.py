"""Tension lost to a tendon wrapped around its guides."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values
from tendon_newton.effects.loaded_gear import load_side


class RoutingFriction(Effect):
    r"""The capstan equation, with one exponent for the whole path.

    .. math:: T_{out} = T_{in}\,e^{-\mu s},\quad s = \operatorname{sign} v,
        \ s \in [-1, 1] \text{ at } v = 0

    Source: Euler (1769) and Eytelwein (1808); the exponent is friction coefficient times wrap
    angle.
    Validity: a limp tendon whose wrap does not change much with the pose; bending stiffness is
    left out.
    Signature: the mechanism lags behind the load cell in proportion to the force, and sticks.
    Confused with: load_dependent_friction (the other side of the load cell) and joint_dry_friction
    (whose friction does not grow with force).
    """

    side = "transmission"
    confused = ("load_dependent_friction", "joint_dry_friction")
    needs_string = True
    dry = ("exponent",)
    parameters = (
        Parameter("exponent", "1", null=0.0, nominal=0.1, lower=0.0, upper=1.5).since(
            "a friction coefficient of 0.3 over a wrap of five radians"
        ),
    )

    @staticmethod
    def transmission(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """T_out = T_in exp(-mu s); what pushes loses as well, and a string never does."""
        return force * wp.exp(-values[0] * load_side(force[0], tendon))
