"""What is read of the motor's current is off by a factor."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter


class CurrentSensorGain(Effect):
    r"""The motor's current is read in proportion, with another factor than 1.

    .. math:: i_{read} = s\,i

    Source: tolerances of a shunt and its amplifier; a register's unit taken from another type.
    Validity: one factor; motor angle and force are read rightly.
    Signature: the current is off in proportion, and motor angle and force are right.
    Confused with: load_cell_gain (with it the force is off, and the current right).
    """

    side = "sensor"
    confused = ("load_cell_gain",)
    parameters = (
        Parameter("scale", "1", of="1/N", null=1.0, nominal=1.0, lower=0.5, upper=2.0).since(
            "beyond, a register's unit is another"
        ),
    )

    @classmethod
    def current_reading(cls, current: Array, time: Array, values: Array) -> Array:
        """Scale the reading."""
        return current * values[0]
