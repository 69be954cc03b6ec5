"""The firmware lets its goal move no faster than a profile's speed."""

import math

import warp as wp

from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real

UNLIMITED = 1.0e30  # A limit [rad/s] from which on there is none


@device_template
def goal_after(before: real, command: real, elapsed: real, values: Values) -> real:
    """Return the goal [rad], which was `before`, after a command has stood for `elapsed` [s]."""
    reach = values[0] * elapsed
    return before + wp.clamp(command - before, -reach, reach)


class CommandRateLimit(Effect):
    r"""The servo acts on a goal that follows the command at a bounded speed.

    .. math:: |\dot g| \le \omega, \qquad e = g - \theta

    Source: the goal speed of Feetech servos (register Goal_Speed, 50 counts/s a unit on some) and
    the profile velocity of Dynamixel X. Logs of an STS3215 whose register was left alone show a
    goal that moves by 26 counts every 8 ms: 5.07 rad/s (docs/real_data.md).
    Validity: a profile that starts and stops at once; acceleration_limit has a slope as well.
    Signature: after a jump of the command the force grows with time as a ramp, the longer the
    farther the jump; slow motion is not touched.
    Confused with: speed_limit, which bounds the shaft and not the goal, so that a weak servo feels
    nothing of it; actuator_lag and command_delay in jumps of one size.
    """

    side = "actuator"
    confused = ("command_delay", "actuator_lag", "speed_limit")
    memory = Stage.ERROR
    parameters = (
        Parameter("limit", "rad/s", null=math.inf, nominal=5.0, lower=0.2, upper=100.0).since(
            "hobby servos turn at 3 to 12 rad/s; slow profiles are a tenth of it"
        ),
    )

    @staticmethod
    def error(error: Jet, tendon: Tendon, values: Values) -> Jet:
        """Reckon the error from the goal in place of the command."""
        out = error
        if values[0] < real(UNLIMITED):
            goal = goal_after(values[3], tendon.command, tendon.elapsed, values)
            out = error + Jet(goal - tendon.command, real(0.0), real(0.0))
        return out

    @staticmethod
    def remember(error: Jet, tendon: Tendon, values: Values) -> real:
        """The goal."""
        return goal_after(values[3], tendon.command, tendon.elapsed, values)
