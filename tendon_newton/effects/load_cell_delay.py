"""The load cell's clock is late."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class LoadCellDelay(Effect):
    r"""Each reading belongs to an earlier instant.

    .. math:: F_{read}(t) = F(t - \delta)

    Before the first row the cell reads the force at rest.
    Source: averaging and transport between two microcontrollers that share no clock.
    Validity: a constant delay.
    Signature: force is shifted in time against theta, which is untouched.
    Confused with: load_cell_lag (the row of a jump tells), command_delay (theta tells).
    """

    side = "sensor"
    confused = ("command_delay", "load_cell_lag")
    parameters = (
        Parameter("delay", "s", null=0.0, nominal=0.03, lower=0.0, upper=0.5).since(
            "ten readings of a slow cell"
        ),
    )

    @staticmethod
    def cell_clock(time: real, values: Values) -> real:
        """The instant whose force is reported now."""
        return time - values[0]
