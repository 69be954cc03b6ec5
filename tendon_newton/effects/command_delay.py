"""Time between a command and the servo's acting on it."""

from tendon_newton.effects.base import Effect, Parameter, Values, real


class CommandDelay(Effect):
    r"""The servo acts on an old command.

    .. math:: \theta_d(t) \to \theta_d(t - \delta)

    The commands are a staircase, and so is the delayed command. A substep of a rollout ends where a
    command comes to the first servo; in a control loop and at further servos it sees the mean.
    Source: bus, USB latency and firmware period; 0.2 s were seen on a hobby servo behind ROS 2.
    Validity: a constant delay; jitter is left out.
    Signature: the residual follows the rate of the command; every jump loses its first rows.
    Confused with: actuator_lag and viscous_friction on slow commands; steps and fast sines tell,
    since only a delay leaves the first rows of a jump without any answer.
    """

    side = "actuator"
    confused = ("actuator_lag", "viscous_friction")
    parameters = (
        Parameter("delay", "s", null=0.0, nominal=0.02, lower=0.0, upper=0.4).since(
            "twice the longest seen"
        ),
    )

    @staticmethod
    def clock(time: real, values: Values) -> real:
        """The instant at which the command was given that acts now."""
        return time - values[0]
