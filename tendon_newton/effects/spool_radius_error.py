"""The spool is not as large as the model says."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class SpoolRadiusError(Effect):
    r"""The tendon lies on another radius than the drawing's.

    .. math:: \theta = \frac{l}{s\,r}, \qquad \dot\theta = \frac{v}{s\,r}

    The gain in N/rad is that at the tendon and stays.
    Source: a tendon lies on the core plus half its own thickness, and climbs on its own windings.
    Validity: one layer of windings; a radius that grows with the windings is left out.
    Signature: theta is scaled against every other measure of position; the tip does not move with
    it.
    Confused with: joint_stiffness_error, tendon_compliance and an obstruction at 0 on one spring
    alone; two springs, or a finger with a tracked tip, tell.
    """

    side = "transmission"
    confused = ("tendon_compliance", "obstruction", "joint_stiffness_error")
    needs_string = True
    parameters = (
        Parameter(
            "scale", "1", of="m/rad", null=1.0, nominal=1.0, lower=0.5, upper=2.0, tolerance=0.015
        ).since("a core of half or twice the radius is another spool"),
    )

    @staticmethod
    def radius(radius: real, values: Values) -> real:
        """Scale the spool's radius."""
        return radius * values[0]
