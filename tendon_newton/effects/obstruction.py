"""Something is in the way."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class Obstruction(Effect):
    r"""A one-sided contact that the mechanism meets at one excursion.

    .. math::

        F \to F - k\,\delta\,\max(0,\ 1 + \chi\,\dot l), \qquad
        \delta = \max(0,\ l - \theta_0 r)

    The place is given as the nominal spool would read it, and is the same on every bench.
    Source: a cable, a burr or a print's support in the path; Hunt and Crossley (1975) for what the
    contact loses, as where a link meets an obstacle.
    Validity: a contact without friction.
    Signature: nothing up to one position, then a stiffness that grows at once.
    Confused with: spring_stiffening, which grows smoothly; joint_stiffness_error when it begins at
    0.
    """

    side = "mechanism"
    confused = ("joint_stiffness_error", "spring_stiffening")
    undamped = True
    parameters = (
        Parameter("stiffness", "N/m", null=0.0, nominal=500.0, lower=0.0, upper=20000.0).since(
            "above, the contact is an end stop"
        ),
        Parameter("position", "rad", of="m", null=0.0, nominal=1.0, lower=0.0, upper=7.0).since(
            "the travel of a bench is below 6.4 rad"
        ),
        Parameter(
            "dissipation", "s/m", null=0.0, nominal=1.0, lower=0.0, upper=10.0, optional=True
        ).since("Hunt and Crossley: 0.1 to 0.5 for wood and metal; skin and rubber have 10"),
    )

    @staticmethod
    def transmission(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """Lose what the contact takes; it never pulls."""
        depth = tendon.length - values[1] * tendon.nominal_radius
        closing = real(1.0) + values[2] * tendon.rate
        out = force
        if depth > real(0.0) and closing > real(0.0):
            elastic = values[0] * depth
            out = force - Jet(elastic * closing, values[0] * closing, elastic * values[2])
        return out
