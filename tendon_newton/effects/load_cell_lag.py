"""The load cell follows the force late."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class LoadCellLag(Effect):
    r"""A first-order lag on the reading.

    .. math:: \tau \dot F_{read} = F - F_{read}

    The lag is solved exactly for a force that moves in a straight line over a step.
    Source: filters inside amplifiers such as the HX711, and averaging in firmware.
    Validity: one dominant time constant.
    Signature: jumps of force are rounded off; theta is untouched.
    Confused with: load_cell_delay (the row of a jump tells), actuator_lag (theta tells).
    """

    side = "sensor"
    confused = ("actuator_lag", "load_cell_delay")
    parameters = (
        Parameter("time_constant", "s", null=0.0, nominal=0.03, lower=0.0, upper=0.5).since(
            "ten readings of a slow cell"
        ),
    )

    @staticmethod
    def cell_lag(time_constant: real, values: Values) -> real:
        """Add to the cell's time constant."""
        return time_constant + values[0]
