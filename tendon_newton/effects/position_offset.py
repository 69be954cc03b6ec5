"""The encoder's zero is not the mechanism's zero."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class PositionOffset(Effect):
    r"""The encoder reports an angle shifted by a constant, and the servo's loop believes it.

    .. math:: \theta = l / r + \varphi

    Source: spools and horns sit on splines; a home position found by hand is good to a few degrees.
    Validity: the offset does not change during a recording.
    Signature: the same position error everywhere, and a force error of gain times offset.
    Confused with: tendon_slack while taut (slack alone lets theta follow the command when the
    tendon is loose); gravity_misalignment on one spring.
    """

    side = "sensor"
    confused = ("tendon_slack", "gravity_misalignment")
    parameters = (
        Parameter("angle", "rad", null=0.0, nominal=0.0, lower=-1.0, upper=1.0).since(
            "a tooth of a 25-tooth spline is 0.25 rad"
        ),
    )

    @staticmethod
    def angle(angle: Jet, tendon: Tendon, values: Values) -> Jet:
        """Shift the angle that the encoder reports."""
        return angle + Jet(values[0], real(0.0), real(0.0))
