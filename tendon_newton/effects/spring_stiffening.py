"""The return springs stiffen along their range."""

from tendon_newton.effects.base import Effect, Jet, Joint, Parameter, Values, real


class SpringStiffening(Effect):
    r"""A cubic spring.

    .. math:: \tau_j \to \tau_j \left(1 + \beta \left(\frac{q_j}{q_{max,j}}\right)^2\right)

    Source: the first odd term after Hooke's: Duffing (1918). Printed flexures and rubber tubes do
    so.
    Validity: smooth springs inside their range.
    Signature: nothing at small angles, and an error that grows with the third power of position.
    Confused with: obstruction (which begins at once) and joint_stiffness_error over a narrow range.
    """

    side = "mechanism"
    confused = ("obstruction", "joint_stiffness_error")
    parameters = (
        Parameter("beta", "1", null=0.0, nominal=0.5, lower=-0.8, upper=5.0).since(
            "softer than a fifth or six times as stiff at the end"
        ),
    )

    @staticmethod
    def spring(torque: Jet, joint: Joint, values: Values) -> Jet:
        """Scale the torque by 1 + beta (q / q_max)^2."""
        slope = values[0] / (joint.upper * joint.upper)
        more = real(1.0) + slope * joint.position * joint.position
        bend = real(2.0) * slope * joint.position * torque[0]
        return torque * more + Jet(real(0.0), bend, real(0.0))
