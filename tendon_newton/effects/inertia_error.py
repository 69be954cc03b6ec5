"""The links resist acceleration more than they weigh."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class InertiaError(Effect):
    r"""Masses and inertias are scaled in what they resist, not in what they weigh.

    .. math:: s\,(M \ddot q + C \dot q) = \tau - G

    Source: rotors behind gears, tendons and sensors that move along, errors of a CAD model.
    Validity: one factor for all links; added weight is another cause.
    Signature: an error in proportion to acceleration; resonances move.
    Confused with: joint_damping_error and actuator_lag without fast motion; steps and fast sines
    tell.
    """

    side = "mechanism"
    confused = ("actuator_lag", "joint_damping_error")
    parameters = (
        Parameter("scale", "1", of="N s2/m", null=1.0, nominal=1.0, lower=0.2, upper=10.0).since(
            "a heavy fingertip or a reflected rotor"
        ),
    )

    @staticmethod
    def inertia(scale: real, values: Values) -> real:
        """Scale what resists acceleration."""
        return scale * values[0]
