"""The motor's force follows its demand late."""

from tendon_newton.device_code.first_order_lag import lagged, share_kept
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real


class ActuatorLag(Effect):
    r"""A first-order lag on the motor's force, after the servo's limit and before friction.

    .. math:: \tau \dot F_m = u - F_m,
        \qquad u = \operatorname{clip}(P (\theta_d - \theta), \pm F_{max})

    The lag is solved exactly over a step for a demand that moves in a straight line, so that a time
    constant far below the step does no harm. The solution is of second order for a demand that does
    not depend on acceleration.
    Source: winding inductance, current loop and filters of the firmware.
    Validity: one dominant time constant.
    Signature: the residual follows the rate of the force; the row of a jump shows a first, small
    answer.
    Confused with: command_delay (the row of a jump tells), viscous_friction (fast reversals tell).
    """

    side = "actuator"
    confused = ("command_delay", "viscous_friction")
    memory = Stage.MOTOR_FORCE
    parameters = (
        Parameter("time_constant", "s", null=0.0, nominal=0.02, lower=0.0, upper=0.5).since(
            "a tenth of a hobby servo's slowest response"
        ),
    )

    @staticmethod
    def motor_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """The lag's answer to a demand that moved in a straight line since the memory was true."""
        taken = real(1.0) - share_kept(tendon.elapsed, values[0])
        rate = force[1] * tendon.velocity + force[2] * tendon.acceleration
        value = lagged(values[3], force[0], rate, tendon.elapsed, values[0])
        return Jet(value, taken * force[1], taken * force[2])

    @staticmethod
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """The motor's force."""
        return force[0]
