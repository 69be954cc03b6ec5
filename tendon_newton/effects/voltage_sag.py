"""The supply gives way under load."""

import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, lowered, real


class VoltageSag(Effect):
    r"""The voltage falls in proportion to the current, and the force with it.

    .. math:: F = \frac{F_m}{1 + \sigma\,|F_m|}, \qquad \frac{V}{V_0} = 1 - \sigma\,|F|

    Source: Ohm's law for leads, plugs and a battery's inner resistance, at a duty cycle that is
    given.
    Validity: slow against the supply's capacitors; the servo's logic is not affected.
    Signature: large forces fall short, in proportion to their square; small ones do not.
    Confused with: gain_error over a narrow range of forces, force_saturation over a wide one.
    """

    side = "actuator"
    confused = ("gain_error", "force_saturation")
    parameters = (
        Parameter("sag", "1/N", null=0.0, nominal=0.01, lower=0.0, upper=0.2).since(
            "a supply that halves the force at 5 N is not usable"
        ),
    )

    @staticmethod
    def motor_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m / (1 + sag |F_m|)."""
        out = force
        if values[0] > real(0.0):
            left = real(1.0) / (real(1.0) + values[0] * wp.abs(force[0]))
            out = Jet(force[0] * left, force[1] * left * left, force[2] * left * left)
        return out

    @classmethod
    def voltage_reading(cls, supply: Array, time: Array, values: Array) -> Array:
        """The supply is lower by as much as the force."""
        return lowered(supply, values[0])
