"""The motor's current is read late."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter, earlier


class CurrentSensorDelay(Effect):
    r"""Each reading of the motor's current belongs to an earlier instant.

    .. math:: i_{read}(t) = i(t - \delta)

    Before the first row it is that of the first. Rows are joined by a cubic spline.
    Source: a register that the firmware filters, or renews seldom.
    Validity: a constant delay.
    Signature: the current is shifted in time against motor angle and force, which are untouched.
    Confused with: actuator_lag (angle and force are late with it).
    """

    side = "sensor"
    confused = ("actuator_lag",)
    parameters = (
        Parameter("delay", "s", null=0.0, nominal=0.03, lower=0.0, upper=0.5).since(
            "a register that is renewed twice a second"
        ),
    )

    @classmethod
    def current_reading(cls, current: Array, time: Array, values: Array) -> Array:
        """The current at the instant that is reported now."""
        return earlier(current, time, values[0])
