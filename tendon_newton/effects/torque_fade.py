"""A motor that grows weaker while it pulls."""

from tendon_newton.device_code.first_order_lag import share_kept
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real


@device_template
def weakness(before: real, force: real, elapsed: real, values: Values) -> real:
    """Return rho, which was `before`, after a force has been held for `elapsed` [s]."""
    settled = values[0] * force * force
    return settled + (before - settled) * share_kept(elapsed, values[1])


@device_template
def built_up(before: real, demand: real, elapsed: real, values: Values) -> real:
    """Return rho after a demand was there for `elapsed` [s], whose force rho itself divides.

    (rho - a) (1 + rho)^2 = b has one root above a; Newton's steps reach it from there and never
    pass it. What is given by turns, rho of a force and a force of rho, would not settle under load.
    """
    kept = share_kept(elapsed, values[1])
    a = before * kept
    b = (real(1.0) - kept) * values[0] * demand * demand
    rho = a
    change = b
    for _ in range(8):
        if change != real(0.0):  # a short time with a small force takes two steps
            more = real(1.0) + rho
            nearer = rho - (rho - a - b / (more * more)) / (
                real(1.0) + real(2.0) * b / (more * more * more)
            )
            change = nearer - rho
            rho = nearer
    return rho


class TorqueFade(Effect):
    r"""The motor grows weaker while it pulls, and recovers while it rests.

    .. math:: F = \frac{F_m}{1 + \rho}, \qquad
        \tau\,\dot\rho = \kappa F^2 - \rho

    Source: copper gains 0.39 % of resistance per kelvin, and its heat grows with the square of the
    current; a driver that folds its current back does the same. Logs of a Dynamixel XL330 ask for
    this law with a time constant of 0.75 s. Copper alone would have to warm by
    180 K there.
    Validity: one time constant; the motor has its full strength after a rest.
    Signature: the first pull at a load is stronger than the next; a slow approach ends short of a
    fast one; held loads sink.
    Confused with: voltage_sag (at once, and without memory), gain_drift (whatever the load),
    force_saturation where the load is always high.
    """

    side = "actuator"
    confused = ("gain_drift", "force_saturation", "voltage_sag")
    memory = Stage.MOTOR_FORCE
    parameters = (
        Parameter("fade", "1/N2", null=0.0, nominal=0.003, lower=0.0, upper=0.5).since(
            "1.4 N, of a small servo's 21, would halve themselves"
        ),
        Parameter("time_constant", "s", null=1.0, nominal=1.0, lower=0.05, upper=60.0).since(
            "windings of hobby motors warm in seconds, their cases in minutes"
        ),
    )

    @staticmethod
    def motor_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m / (1 + rho)."""
        rho = built_up(values[3], force[0], tendon.elapsed, values)
        return force * (real(1.0) / (real(1.0) + rho))

    @staticmethod
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """Return rho after the force that was held."""
        return weakness(values[3], force[0], tendon.elapsed, values)
