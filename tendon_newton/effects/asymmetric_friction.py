"""Dry friction that differs between winding in and winding out."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class AsymmetricFriction(Effect):
    r"""A constant force against the tendon's motion for each of its two directions.

    .. math:: F = F_m - F_C(s)\,s, \qquad F_C = F_{in} \text{ for } s > 0,\ F_{out} \text{ else}

    Source: Armstrong-Helouvry et al., A survey of models, analysis tools and compensation methods
    for the control of machines with friction (1994), section 2.2: gears whose flanks differ.
    Validity: as for coulomb_friction.
    Signature: that of coulomb_friction with half the sum of both, beside a constant force of half
    their difference while the tendon moves.
    Confused with: coulomb_friction, which it contains; load_cell_bias and gravity_misalignment,
    which stay at rest.
    """

    side = "actuator"
    confused = ("coulomb_friction", "gravity_misalignment", "load_cell_bias")
    dry = ("winding", "unwinding")
    includes = ("coulomb_friction",)
    parameters = (
        Parameter("winding", "N", null=0.0, nominal=0.8, lower=0.0, upper=8.0).since(
            "as for coulomb_friction"
        ),
        Parameter("unwinding", "N", null=0.0, nominal=0.4, lower=0.0, upper=8.0).since(
            "as for coulomb_friction"
        ),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - F_C(s) s."""
        level = values[0]
        if tendon.direction < real(0.0):
            level = values[1]
        return force - Jet(level * tendon.direction, real(0.0), real(0.0))
