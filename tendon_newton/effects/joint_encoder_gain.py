"""The joints' encoders are off by a factor."""

from tendon_newton.data.recording import Array
from tendon_newton.effects.base import Effect, Parameter


class JointEncoderGain(Effect):
    r"""Encoders on joints read in proportion to the joints' motion, with another factor than 1.

    .. math:: q_{read} = s\,q

    Source: counts per turn or the gear of an encoder taken from another type; a magnet beside its
    chip reads nearly in proportion over part of a turn.
    Validity: one factor for the encoders of all joints; motor angle and force are read rightly.
    Signature: the joints are off in proportion, and motor angle and force are right.
    Confused with: spool_radius_error (the force tells: with it the springs seem off, too),
    tendon_compliance (the joint lags behind the force and not behind itself).
    """

    side = "sensor"
    confused = ("spool_radius_error", "tendon_compliance")
    parameters = (
        Parameter("scale", "1", null=1.0, nominal=1.0, lower=0.5, upper=2.0).since(
            "beyond, counts per turn are wrong by an octave"
        ),
    )

    @classmethod
    def joint_reading(cls, joints: Array, time: Array, values: Array) -> Array:
        """Scale the reading."""
        return joints * values[0]
