"""Gear friction under load that is greatest at rest."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values
from tendon_newton.effects.loaded_gear import gear_loaded


class LoadStribeckFriction(Effect):
    r"""Gear friction under load whose share falls from breakaway to sliding with speed.

    .. math:: F = F_m - K(v)\,|F_m + F|\,s, \qquad
        K(v) = K_C + (K_S - K_C)\, e^{-(v / (r v_s))^2}

    Source: Duclusaud et al. (2025), the load terms of model M4 with their exponent at 2. Their M5,
    which weighs motor and load apart, has two numbers more.
    Validity: as for gear_load_friction. The falling branch enters the dynamics, but not the
    solver's Jacobian, which stays definite so.
    Signature: stick and slip at low speed whose jumps grow with the force.
    Confused with: gear_load_friction, which it contains; only slow motion under load tells.
    """

    side = "actuator"
    confused = ("gear_load_friction",)
    dry = ("coefficient", "static_coefficient")
    includes = ("gear_load_friction",)
    parameters = (
        Parameter("coefficient", "1", null=0.0, nominal=0.1, lower=0.0, upper=0.8).since(
            "as for gear_load_friction"
        ),
        Parameter("static_coefficient", "1", null=0.0, nominal=0.2, lower=0.0, upper=0.9).since(
            "0.06 to 0.23 in the parameter files published with the source"
        ),
        Parameter(
            "stribeck_velocity", "rad/s", null=1.0, nominal=1.0, lower=0.05, upper=10.0
        ).since("0.3 to 2.6 rad/s in the same files"),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = ((1 - K(v) s') F_m - C s) / (1 + K(v) s')."""
        coefficient = values[0]
        if values[1] > values[0]:
            share = tendon.velocity / (tendon.spool_radius * values[2])
            coefficient = coefficient + (values[1] - values[0]) * wp.exp(-share * share)
        return gear_loaded(force, coefficient, tendon)
