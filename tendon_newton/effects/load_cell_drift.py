"""The load cell's zero wanders."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class LoadCellDrift(Effect):
    r"""A bias that grows in a straight line with the time since the recording's first row.

    .. math:: F_{read} = F + \dot b\,t

    Source: strain gauges and amplifiers that warm up.
    Validity: the first minutes, in which the temperature rises steadily.
    Signature: force is off by the time alone and theta is right.
    Confused with: gain_drift (which needs a load and moves theta), load_cell_bias on short logs.
    """

    side = "sensor"
    confused = ("gain_drift", "load_cell_bias")
    parameters = (
        Parameter("rate", "N/s", of="1/s", null=0.0, nominal=0.0, lower=-1.0, upper=1.0).since(
            "a cell that runs away by a newton per second is broken"
        ),
    )

    @staticmethod
    def cell(force: real, time: real, values: Values) -> real:
        """Add what has built up since the first row."""
        return force + values[0] * time
