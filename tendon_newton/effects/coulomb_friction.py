"""Dry friction that does not depend on load or speed."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class CoulombFriction(Effect):
    r"""A constant force against the tendon's motion, and what it takes below that to hold still.

    .. math:: F = F_m - F_C\,s,\quad s = \operatorname{sign} v,\ s \in [-1, 1] \text{ at } v = 0

    Source: Coulomb (1785); Olsson et al. (1998), eq. 1.
    Validity: slips far above the microns over which bristles bend.
    Signature: the force differs by twice F_C between winding in and out at any speed, and position
    stays where it stopped.
    Confused with: stribeck_friction (slow motion tells), load_dependent_friction (a wide range of
    forces tells), joint_dry_friction (the load cell sits between them).
    """

    side = "actuator"
    confused = ("stribeck_friction", "load_dependent_friction", "joint_dry_friction")
    dry = ("force",)
    parameters = (
        Parameter("force", "N", null=0.0, nominal=0.5, lower=0.0, upper=8.0).since(
            "a third of the 21 N that the servo gives"
        ),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - F_C s."""
        return force - Jet(values[0] * tendon.direction, real(0.0), real(0.0))
