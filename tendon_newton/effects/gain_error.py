"""The servo's position gain is not what the model says."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values


class GainError(Effect):
    r"""The servo answers a position error with another stiffness than the model's.

    .. math:: F = s\,P\,(\theta_d - \theta)

    Source: the gain of a force source behind a position loop depends on supply, winding and gear,
    none of which is in a data sheet.
    Validity: a gain that is the same everywhere; see gain_drift and voltage_sag for others.
    Signature: the error is proportional to the force, without a loop.
    Confused with: load_cell_gain (theta is untouched by that), joint_stiffness_error in theta
    alone.
    """

    side = "actuator"
    confused = ("joint_stiffness_error", "load_cell_gain")
    parameters = (
        Parameter("scale", "1", of="N/rad", null=1.0, nominal=1.0, lower=0.2, upper=3.0).since(
            "unit-to-unit spread of hobby servos is within a factor of three"
        ),
    )

    @staticmethod
    def error(error: Jet, tendon: Tendon, values: Values) -> Jet:
        """Scale the error that the gain multiplies."""
        return error * values[0]
