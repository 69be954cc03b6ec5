"""The joints' encoders are late."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter, earlier


class JointEncoderDelay(Effect):
    r"""Each reading of the encoders on joints belongs to an earlier instant.

    .. math:: q_{read}(t) = q(t - \delta)

    Before the first row the joints rest. Rows are joined by a cubic spline.
    Source: another bus, a filter or a second microcontroller without a common clock.
    Validity: a constant delay, the same for the encoders of all joints.
    Signature: the joints are shifted in time against motor angle and force, which are untouched.
    Confused with: tendon_compliance (it bends the force's way, too), command_delay (the motor's
    angle tells).
    """

    side = "sensor"
    confused = ("tendon_compliance", "command_delay")
    parameters = (
        Parameter("delay", "s", null=0.0, nominal=0.03, lower=0.0, upper=0.5).since(
            "a filter of half a second makes an encoder useless"
        ),
    )

    @classmethod
    def joint_reading(cls, joints: Array, time: Array, values: Array) -> Array:
        """The joints at the instant that is reported now."""
        return earlier(joints, time, values[0])
