"""The load cell's calibration is off by a factor."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class LoadCellGain(Effect):
    r"""The reading is in proportion to the force, with another factor than calibrated.

    .. math:: F_{read} = s\,F

    Source: a calibration with one weight on another cell.
    Validity: a linear cell.
    Signature: force is off in proportion and theta is right.
    Confused with: gain_error (theta tells).
    """

    side = "sensor"
    confused = ("gain_error",)
    parameters = (
        Parameter(
            "scale", "1", of="1/N", null=1.0, nominal=1.0, lower=0.3, upper=3.0, tolerance=0.015
        ).since("beyond, a calibration is of another cell"),
    )

    @staticmethod
    def cell(force: real, time: real, values: Values) -> real:
        """Scale the reading."""
        return force * values[0]
