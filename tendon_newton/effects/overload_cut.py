"""The firmware protects its motor: after some time of full load it gives a part only."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real

RESTED = 1.0e6  # Time [s] without a load after which no protection acts


class OverloadCut(Effect):
    r"""A duty above a threshold for some time is cut until the demand turns round.

    .. math:: |u| \le f \text{ once } |u| > u_o \text{ has lasted for } T

    Source: registers Overload_Torque (36), Protection_Time (35) and Protective_Torque (34) of
    Feetech STS servos: 80 % for 2 s, then 20 %, until a goal on the other side.
    Validity: a threshold that is met either way; what lasts is counted anew after each row of a
    lower load.
    Signature: a held load is let go a fixed time after the effort rose, all at once, and is not
    taken up again from the same side.
    Confused with: torque_fade (gradual, and back after a rest), force_saturation (at once).
    """

    side = "actuator"
    confused = ("force_saturation", "torque_fade")
    memory = Stage.DUTY
    switches = ("duty", "time")
    counts_to = 2
    parameters = (
        Parameter("duty", "1", of="N", null=1.0, nominal=0.8, lower=0.05, upper=1.0).since(
            "80 of 100 from the factory"
        ),
        Parameter("fraction", "1", of="N", null=1.0, nominal=0.2, lower=0.0, upper=1.0).since(
            "20 of 100 from the factory"
        ),
        Parameter("time", "s", null=2.0, nominal=2.0, lower=0.05, upper=2.55).since(
            "200 of 255 units of 10 ms from the factory"
        ),
    )

    @staticmethod
    def duty(duty: Jet, tendon: Tendon, values: Values) -> Jet:
        """Cut the duty on the side that was overloaded."""
        out = duty
        above = duty[0] * wp.sign(values[3]) > values[1]
        if above and wp.abs(values[3]) >= values[2]:
            out = Jet(wp.sign(values[3]) * values[1], real(0.0), real(0.0))
        return out

    @staticmethod
    def remember(duty: Jet, tendon: Tendon, values: Values) -> real:
        """The time [s] for which the load has lasted, with the sign of its side."""
        lasted = values[3]
        cut = wp.abs(lasted) >= values[2]
        turned = duty[0] * lasted < real(0.0)
        out = real(0.0)
        if cut and not turned:
            out = lasted
        elif wp.abs(duty[0]) > values[0]:
            out = wp.sign(duty[0]) * tendon.elapsed
            if not turned:
                out = out + lasted
        if tendon.elapsed > real(RESTED):
            out = real(0.0)
        return out
