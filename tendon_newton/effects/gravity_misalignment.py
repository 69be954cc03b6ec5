"""The bench is not level."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class GravityMisalignment(Effect):
    r"""Gravity does not point along the base's -z: the bench is tipped about +y.

    .. math:: g \to R_y(-\alpha)\,g

    A positive angle tips the finger, and +x of the rail, downward, so that gravity helps the
    tendon.
    Source: geometry.
    Validity: a bench that is rigid and at rest.
    Signature: a force that changes with the pose of a finger, and is constant on a rail.
    Confused with: tendon_slack on a spring (two springs tell), joint_stiffness_error on a finger
    (a hanging pose tells).
    """

    side = "mechanism"
    confused = ("tendon_slack", "joint_stiffness_error")
    parameters = (
        Parameter(
            "angle", "rad", null=0.0, nominal=0.0, lower=-1.6, upper=1.6, absolute=True
        ).since("a bench stood on its end"),
    )

    @staticmethod
    def tilt(angle: real, values: Values) -> real:
        """Add to the angle by which the bench is tipped."""
        return angle + values[0]
