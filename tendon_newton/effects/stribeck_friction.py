"""Dry friction that is greatest at rest."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class StribeckFriction(Effect):
    r"""Dry friction that falls from its static to its Coulomb value as the tendon gathers speed.

    .. math:: F = F_m - \left(F_C + (F_S - F_C)\, e^{-(v / (r v_s))^2}\right) s

    Source: Stribeck (1902); Olsson et al. (1998), eq. 4.
    Validity: steady sliding; memory of the lubricant film is left out. A static force below the
    Coulomb force counts as that: what grows with speed is viscous. The falling branch enters
    the dynamics, but not the solver's Jacobian, which stays definite so.
    Signature: stick and slip at low speed, with a force that jumps down as motion begins.
    Confused with: coulomb_friction, which it contains; only slow motion tells.
    """

    side = "actuator"
    confused = ("coulomb_friction",)
    dry = ("coulomb_force", "static_force")
    includes = ("coulomb_friction",)
    parameters = (
        Parameter("coulomb_force", "N", null=0.0, nominal=0.5, lower=0.0, upper=8.0).since(
            "as for coulomb_friction"
        ),
        Parameter("static_force", "N", null=0.0, nominal=0.8, lower=0.0, upper=12.0).since(
            "up to one and a half times the Coulomb force"
        ),
        Parameter(
            "stribeck_velocity", "rad/s", null=1.0, nominal=1.0, lower=0.05, upper=10.0
        ).since("hobby gears run mixed up to a few rad/s"),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - (F_C + (F_S - F_C) exp(-(v / (r v_s))^2)) s."""
        level = values[0]
        if values[1] > values[0]:
            share = tendon.velocity / (tendon.spool_radius * values[2])
            level = level + (values[1] - values[0]) * wp.exp(-share * share)
        return force - Jet(level * tendon.direction, real(0.0), real(0.0))
