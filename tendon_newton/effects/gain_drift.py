"""The servo grows weaker as it warms up."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class GainDrift(Effect):
    r"""The position gain falls in a straight line with the time since the recording's first row.

    .. math:: F = P\,(1 - \beta t)\,(\theta_d - \theta)

    Source: copper gains 0.39 % of resistance per kelvin and magnets lose 0.1 to 0.2 %.
    Validity: the first minutes of warming up, in which the temperature rises steadily.
    Signature: the error is proportional to the force and grows along the recording.
    Confused with: load_cell_drift (which moves force by the same at any load) and gain_error on
    short logs; a long recording that comes back to the same commands tells.
    """

    side = "actuator"
    confused = ("gain_error", "load_cell_drift")
    parameters = (
        Parameter("rate", "1/s", null=0.0, nominal=0.005, lower=-0.05, upper=0.05).since(
            "a half of the gain in ten seconds is a fault of another kind"
        ),
    )

    @staticmethod
    def error(error: Jet, tendon: Tendon, values: Values) -> Jet:
        """Scale the error that the gain multiplies by what is left of the gain."""
        return error * (real(1.0) - values[0] * tendon.time)
