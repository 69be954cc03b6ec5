"""The servo gives up earlier than the model says."""

import math

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real

# Distance from the limit [knees] at which nothing is missing: exp(-36) is less than a digit
STRAIGHT = 36.0
UNLIMITED = 1.0e30  # A limit above this is none [N]


class ForceSaturation(Effect):
    r"""The motor's force is limited either way, at once or over a knee.

    .. math:: F_m \to \operatorname{sign}(F_m)\, F_{max}
        \left(1 - \kappa \ln\left(1 + e^{(1 - |F_m| / F_{max}) / \kappa}\right)\right)

    Without a knee it is the clipped force, to which this tends as \(\kappa\) goes to zero.
    Source: current limits in firmware clip; a supply or an amplifier at its end gives way over a
    knee, for which this is the usual smooth minimum (Boyd and Vandenberghe, Convex Optimization,
    2004, section 3.1.5, log-sum-exp).
    Validity: a limit that does not depend on speed; see speed_limit and voltage_sag.
    Signature: force stays at one height while the position error grows; below it nothing is wrong.
    Confused with: speed_limit and obstruction in single steps; ramps into the limit tell.
    """

    side = "actuator"
    confused = ("speed_limit", "obstruction")
    parameters = (
        Parameter("limit", "N", null=math.inf, nominal=10.0, lower=0.5, upper=100.0).since(
            "from a tenth to five times what a small servo gives"
        ),
        Parameter("knee", "1", null=0.0, nominal=0.05, lower=0.0, upper=0.2, optional=True).since(
            "at 0.2 a seventh is missing at the limit already: more is an amplifier's law"
        ),
    )

    @staticmethod
    def motor_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """Keep the force below the limit; what is clipped does not depend on anything any more."""
        limit = values[0]
        knee = values[1]
        size = wp.abs(force[0])
        out = force
        if knee <= real(0.0) and size > limit:
            out = Jet(wp.sign(force[0]) * limit, real(0.0), real(0.0))
        if knee > real(0.0) and size > real(0.0) and limit < real(UNLIMITED):
            room = (real(1.0) - size / limit) / knee
            if room < real(STRAIGHT):
                odds = wp.exp(room)
                kept = limit * wp.max(real(1.0) - knee * wp.log(real(1.0) + odds), real(0.0))
                slope = odds / (real(1.0) + odds)
                out = Jet(wp.sign(force[0]) * kept, slope * force[1], slope * force[2])
        return out
