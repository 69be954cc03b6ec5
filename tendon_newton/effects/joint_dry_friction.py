"""Dry friction in the joints."""

from tendon_newton.effects.base import Effect, Joint, Parameter, Values, real


class JointDryFriction(Effect):
    r"""Coulomb friction at every joint, a share of what its spring gives at the end of the range.

    .. math:: |\tau_f| \le f\,k_j\,(q_{max,j} - q_{0,j})

    Source: Coulomb (1785); pins in printed holes.
    Validity: friction that does not grow with the tendon's force; see routing_friction for one
    that does.
    Signature: the mechanism lags behind the load cell by the same force everywhere, and sticks.
    Confused with: routing_friction; a wide range of forces tells.
    """

    side = "mechanism"
    confused = ("routing_friction",)
    parameters = (
        Parameter(
            "fraction", "1", null=0.0, nominal=0.05, lower=0.0, upper=0.8, of_spring=True
        ).since("a spring must still bring its joint back"),
    )

    @staticmethod
    def joint_friction(limit: real, joint: Joint, values: Values) -> real:
        """Add to the greatest torque that dry friction gives."""
        return limit + values[0] * joint.stiffness * (joint.upper - joint.rest)
