"""The servo ignores small errors."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class Deadband(Effect):
    r"""No force while the position error is small, and a force shifted by as much beyond.

    .. math:: e \to \operatorname{sign}(e)\,\max(0, |e| - w), \qquad e = \theta_d - \theta

    Source: firmware of hobby servos, which rests its gear at the goal.
    Validity: a band that is the same everywhere and either way.
    Signature: a constant force is missing wherever the servo pulls, and position is not held near
    the goal.
    Confused with: load_cell_bias and position_offset as long as the force never comes to zero;
    long ramps tell.
    """

    side = "actuator"
    confused = ("position_offset", "load_cell_bias")
    parameters = (
        Parameter("width", "rad", null=0.0, nominal=0.05, lower=0.0, upper=1.0).since(
            "firmware bands are below 0.1 rad; worn ones are wider"
        ),
    )

    @staticmethod
    def error(error: Jet, tendon: Tendon, values: Values) -> Jet:
        """Take the band off either side of the error."""
        out = Jet(real(0.0), real(0.0), real(0.0))
        if error[0] > values[0]:
            out = error - Jet(values[0], real(0.0), real(0.0))
        if error[0] < -values[0]:
            out = error + Jet(values[0], real(0.0), real(0.0))
        return out
