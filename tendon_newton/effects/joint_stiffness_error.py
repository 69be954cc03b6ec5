"""The return springs are not as stiff as the model says."""

from tendon_newton.effects.base import Effect, Jet, Joint, Parameter, Values


class JointStiffnessError(Effect):
    r"""Every return spring of the mechanism differs from its number by one factor.

    .. math:: \tau_j = -s\,k_j\,(q_j - q_{0,j})

    Source: catalogue tolerance of extension springs is 10 %, of printed flexures far more.
    Validity: one factor for all joints.
    Signature: a position error in proportion to the force, in closed loop opposite in sign to the
    error in force.
    Confused with: spool_radius_error and tendon_compliance on one spring alone (two springs or the
    tip tell), gravity_misalignment on the finger (a hanging pose tells).
    """

    side = "mechanism"
    confused = ("spool_radius_error", "tendon_compliance", "gravity_misalignment")
    parameters = (
        Parameter(
            "scale",
            "1",
            of="N/m",
            null=1.0,
            nominal=1.0,
            lower=0.2,
            upper=4.0,
            tolerance=0.04,
            of_spring=True,
        ).since("printed flexures vary by a factor of two and more"),
    )

    @staticmethod
    def spring(torque: Jet, joint: Joint, values: Values) -> Jet:
        """Scale the spring's torque."""
        return torque * values[0]
