"""The joints are not damped as the model says."""

from tendon_newton.effects.base import Effect, Jet, Joint, Parameter, Values


class JointDampingError(Effect):
    r"""Every joint's viscous damping differs from its number by one factor.

    .. math:: \tau_j = -s\,c_j\,\dot q_j

    Source: grease and printed hinges; damping is the number least known of any mechanism.
    Validity: one factor for all joints.
    Signature: an error in proportion to the speed that the load cell sees as well.
    Confused with: viscoelastic_spring with a short relaxation time, viscous_friction (the other
    side of the load cell).
    """

    side = "mechanism"
    confused = ("viscous_friction", "viscoelastic_spring")
    parameters = (
        Parameter("scale", "1", of="N s/m", null=1.0, nominal=1.0, lower=0.0, upper=10.0).since(
            "from none to ten times as much"
        ),
    )

    @staticmethod
    def damping(torque: Jet, joint: Joint, values: Values) -> Jet:
        """Scale the damper's torque."""
        return torque * values[0]
