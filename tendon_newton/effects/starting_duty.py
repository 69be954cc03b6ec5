"""The firmware gives its motor a least duty to break its gear away."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class StartingDuty(Effect):
    r"""The servo adds a constant duty to any demand, however small, on the demand's side.

    .. math:: u \to u + u_0 \operatorname{sign} u, \qquad u \ne 0

    Source: register Minimum_Startup_Force of Feetech servos, 16 of 1,000 unless it is changed. In
    logs of an STS3215 at rest the duty is kp / 4 (n - 1) + 16 thousandths at n counts of error, to
    the last count and at four gains (docs/real_data.md).
    Validity: a demand that deadband has brought to zero stays there.
    Signature: less friction at rest than in motion; the servo stops nearer to its goal by the same
    force at any gain.
    Confused with: coulomb_friction, of which it takes a part wherever the servo pulls on its way;
    deadband of the other sign at one gain (several gains tell).
    """

    side = "actuator"
    confused = ("deadband", "coulomb_friction")
    parameters = (
        Parameter("duty", "1", of="N", null=0.0, nominal=0.016, lower=0.0, upper=0.3).since(
            "Feetech memory table: 0 to 1,000 thousandths, 16 from the factory"
        ),
    )

    @staticmethod
    def duty(duty: Jet, tendon: Tendon, values: Values) -> Jet:
        """Add the least duty on the side of the demand."""
        out = duty
        if duty[0] > real(0.0):
            out = duty + Jet(values[0], real(0.0), real(0.0))
        if duty[0] < real(0.0):
            out = duty - Jet(values[0], real(0.0), real(0.0))
        return out
