"""The supply is read to give way by another share than it does."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter, lowered


class VoltageSensorSag(Effect):
    r"""The supply is read to give way by more or less than the motor's force says.

    .. math:: \frac{V_{read}}{V_0} = \frac{V}{V_0} - s\,|F|

    Source: a register in front of leads or of a regulator whose loss the motor does not share.
    Validity: leads without inductance; motor angle and force are read rightly.
    Signature: the voltage falls with the load, and no force is lost with it, or the other way.
    Confused with: voltage_sag (with it the force falls as the voltage does).
    """

    side = "sensor"
    confused = ("voltage_sag",)
    parameters = (
        Parameter("sag", "1/N", null=0.0, nominal=0.01, lower=-0.2, upper=0.2).since(
            "as much as a supply may sag"
        ),
    )

    @classmethod
    def voltage_reading(cls, supply: Array, time: Array, values: Array) -> Array:
        """The reading is lower in proportion to the force."""
        return lowered(supply, values[0])
