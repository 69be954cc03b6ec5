"""Viscous friction of motor and gear."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values


class ViscousFriction(Effect):
    r"""Force lost in proportion to the motor's speed.

    .. math:: F = F_m - c\,\dot\theta

    Source: lubricated gears and bearings, Olsson et al., Friction Models and Friction Compensation
    (1998), eq. 2; in a servo also what back-EMF looks like from outside.
    Validity: speeds at which the lubricant film is whole.
    Signature: the error is proportional to the speed, odd in it, and has no loop at rest.
    Confused with: actuator_lag and command_delay (fast reversals tell), joint_damping_error (the
    load cell sits between them: force against theta tells).
    """

    side = "actuator"
    confused = ("command_delay", "actuator_lag", "joint_damping_error")
    parameters = (
        Parameter("coefficient", "N s/rad", null=0.0, nominal=0.5, lower=0.0, upper=20.0).since(
            "a hobby servo loses its 21 N at 3-10 rad/s"
        ),
    )

    @staticmethod
    def spool_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - c theta_dot."""
        return force - values[0] * tendon.angle_rate
