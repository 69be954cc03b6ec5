"""What sees the tip is off by a factor."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter


class TipSensorGain(Effect):
    r"""The tip moves less or further than it is seen to.

    .. math:: x_{read} = s\,x

    Source: metres per pixel of a camera at another distance than that of its calibration.
    Validity: one factor for both axes; motor angle and force are read rightly.
    Signature: the tip is off in proportion, and motor angle and force are right.
    Confused with: spool_radius_error (the force tells: with it the springs seem off, too).
    """

    side = "sensor"
    confused = ("spool_radius_error",)
    parameters = (
        Parameter("scale", "1", null=1.0, nominal=1.0, lower=0.5, upper=2.0).since(
            "beyond, a camera stands twice as far away"
        ),
    )

    @classmethod
    def tip_reading(cls, tip: Array, time: Array, values: Array) -> Array:
        """Scale the reading."""
        return tip * values[0]
