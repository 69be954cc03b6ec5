"""What sees the tip is late."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter, earlier


class TipSensorDelay(Effect):
    r"""Each place of the tip belongs to an earlier instant.

    .. math:: x_{read}(t) = x(t - \delta)

    Before the first row the tip rests. Rows are joined by a cubic spline.
    Source: a camera's exposure, its transfer, and stamps that are given on arrival.
    Validity: a constant delay.
    Signature: the tip is shifted in time against motor angle and force, which are untouched.
    Confused with: tendon_compliance (it bends the force's way, too).
    """

    side = "sensor"
    confused = ("tendon_compliance",)
    parameters = (
        Parameter("delay", "s", null=0.0, nominal=0.03, lower=0.0, upper=0.5).since(
            "fifteen pictures of a camera"
        ),
    )

    @classmethod
    def tip_reading(cls, tip: Array, time: Array, values: Array) -> Array:
        """The tip at the instant that is reported now."""
        return earlier(tip, time, values[0])
