"""The return springs creep."""

from tendon_newton.device_code.first_order_lag import lagged, share_kept
from tendon_newton.effects.base import Effect, Jet, Joint, Parameter, Stage, Values, real


class ViscoelasticSpring(Effect):
    r"""A Maxwell branch, spring and dashpot in series, beside each return spring.

    .. math:: \tau_j \to \tau_j - \rho\,k_j\,(q_j - x_j), \qquad \tau_r\,\dot x_j = q_j - x_j

    The effect remembers the dashpot's place x. The place is solved exactly for a steady speed over
    a step, with an error of third order per step otherwise.
    Source: Maxwell (1867), the standard linear solid; printed polymers relax over seconds.
    Validity: small strains and one relaxation time; the branch is linear and nominal even where
    joint_stiffness_error or spring_stiffening change the spring.
    Signature: position creeps on after every step, and comes back slowly.
    Confused with: joint_damping_error as the relaxation time goes to 0; holds of seconds tell.
    """

    side = "mechanism"
    confused = ("joint_damping_error",)
    memory = Stage.SPRING
    parameters = (
        Parameter(
            "stiffness_ratio", "1", of="N/m", null=0.0, nominal=0.3, lower=0.0, upper=3.0
        ).since("polymers relax by half and more"),
        Parameter("relaxation_time", "s", null=0.5, nominal=0.5, lower=0.005, upper=10.0).since(
            "from a damper to the length of a recording"
        ),
    )

    @staticmethod
    def spring(torque: Jet, joint: Joint, values: Values) -> Jet:
        """Add the branch's torque."""
        stiffness = values[0] * joint.stiffness
        place = lagged(values[3], joint.position, joint.velocity, joint.elapsed, values[1])
        strain = joint.position - place
        kept = share_kept(joint.elapsed, values[1])
        return torque - Jet(stiffness * strain, stiffness * kept, real(0.0))

    @staticmethod
    def remember(torque: Jet, joint: Joint, values: Values) -> real:
        """The dashpot's place."""
        return lagged(values[3], joint.position, joint.velocity, joint.elapsed, values[1])
