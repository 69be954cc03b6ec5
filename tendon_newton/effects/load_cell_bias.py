"""The load cell does not read zero at rest."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class LoadCellBias(Effect):
    r"""A constant on every reading; a biased cell may read below zero.

    .. math:: F_{read} = F + b

    Source: taring under a load that was not seen.
    Validity: a bias that does not change; see load_cell_drift.
    Signature: force is off by the same everywhere and theta is right.
    Confused with: deadband and position_offset (theta tells).
    """

    side = "sensor"
    confused = ("position_offset", "deadband")
    parameters = (
        Parameter(
            "offset", "N", of="1", null=0.0, nominal=0.0, lower=-10.0, upper=10.0, tolerance=0.05
        ).since("half of what the servo gives"),
    )

    @staticmethod
    def cell(force: real, time: real, values: Values) -> real:
        """Add to the reading."""
        return force + values[0]
