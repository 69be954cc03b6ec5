"""The firmware draws a trapezoidal profile of speed to each command."""

import math

import warp as wp

from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real

UNLIMITED = 1.0e30  # A limit [rad/s2] from which on there is none


@device_template
def profile_after(goal: real, rate: real, command: real, elapsed: real, values: Values) -> Jet:
    """Return goal [rad] and rate [rad/s] on the quickest way to rest at a command.

    Exact for a command that stands: speed up, cruise, slow down.
    """
    a = values[0]
    side = real(1.0)
    if command - goal - rate * wp.abs(rate) / (real(2.0) * a) < real(0.0):
        side = real(-1.0)
    far = side * (command - goal)
    fast = side * rate
    reach = a * far + real(0.5) * fast * fast
    if reach < real(0.0):
        reach = real(0.0)
    top = wp.min(wp.sqrt(reach), values[1])
    rising = a
    if top < fast:
        rising = -a
    first = (top - fast) / rising
    last = top / a
    cruise = far - real(0.5) * (fast + top) * first - real(0.5) * top * last
    middle = real(0.0)
    if top > real(0.0):
        middle = wp.max(cruise, real(0.0)) / top
    left = first + middle + last - elapsed
    out = Jet(command, real(0.0), real(0.0))
    if elapsed < first:
        way = (fast + real(0.5) * rising * elapsed) * elapsed
        out = Jet(goal + side * way, side * (fast + rising * elapsed), real(0.0))
    elif left > last:
        out = Jet(command - side * top * (left - real(0.5) * last), side * top, real(0.0))
    elif left > real(0.0):
        out = Jet(command - side * real(0.5) * a * left * left, side * a * left, real(0.0))
    return out


class AccelerationLimit(Effect):
    r"""The servo acts on a goal that speeds up and slows down at a bounded acceleration.

    .. math:: |\ddot g| \le a, \quad |\dot g| \le \omega, \qquad e = g - \theta

    Source: trapezoidal profiles, as in Biagiotti and Melchiorri, Trajectory Planning for Automatic
    Machines and Robots (2008), ch. 3; the acceleration registers of Feetech STS servos (100
    counts/s^2 a unit, at most 254) and of Dynamixel X. In fast sweeps five STS3215 of an SO-101
    show 38.9 to 40.6 rad/s^2, where that register ends at 39.0 (docs/lab/so101.md).
    Validity: a profile that is drawn anew from where it is for every command.
    Signature: a jump of the command begins and ends softly; fast sines lose amplitude and come
    late from one acceleration on, whatever their frequency.
    Confused with: command_rate_limit, which it contains; actuator_lag in jumps of one size.
    """

    side = "actuator"
    confused = ("command_rate_limit", "actuator_lag")
    memory = Stage.ERROR
    includes = ("command_rate_limit",)
    parameters = (
        Parameter("limit", "rad/s2", null=math.inf, nominal=40.0, lower=0.2, upper=1.0e3).since(
            "39 rad/s2 ends the register of an STS3215; Dynamixel X has up to 10,000"
        ),
        Parameter(
            "speed", "rad/s", null=math.inf, nominal=5.0, lower=0.2, upper=100.0, optional=True
        ).since("as for command_rate_limit"),
    )

    @staticmethod
    def error(error: Jet, tendon: Tendon, values: Values) -> Jet:
        """Reckon the error from the goal in place of the command."""
        out = error
        if values[0] < real(UNLIMITED):
            profile = profile_after(values[3], values[4], tendon.command, tendon.elapsed, values)
            out = error + Jet(profile[0] - tendon.command, real(0.0), real(0.0))
        return out

    @staticmethod
    def remember(error: Jet, tendon: Tendon, values: Values) -> real:
        """The goal."""
        out = tendon.command
        if values[0] < real(UNLIMITED):
            profile = profile_after(values[3], values[4], tendon.command, tendon.elapsed, values)
            out = profile[0]
        return out

    @staticmethod
    def remember_second(error: Jet, tendon: Tendon, values: Values) -> real:
        """Rate of what is remembered."""
        out = real(0.0)
        if values[0] < real(UNLIMITED):
            profile = profile_after(values[3], values[4], tendon.command, tendon.elapsed, values)
            out = profile[1]
        return out
