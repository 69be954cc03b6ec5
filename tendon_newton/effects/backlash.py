"""Play between the servo and what it drives."""

from tendon_newton.effects.base import Effect, Jet, Parameter, Tendon, Values, real


class Backlash(Effect):
    r"""The output follows only after the drive has crossed the gap.

    .. math:: \theta = \operatorname{clip}\left(\theta_d,\ \frac{l}{r} - \frac{w}{2},\
        \frac{l}{r} + \frac{w}{2}\right), \quad F = 0 \text{ inside the gap}

    Source: Nordin and Gutman, Controlling mechanical systems with backlash, a survey (2002), eq.
    2: the play of a drive that has no inertia of its own.
    Validity: benches without a preloaded tendon (a string under tension closes every gap); a drive
    whose inertia inside the gap does not matter. Behind a rotor the force jumps at a flank, where
    no step ends: angles are off by up to 10 mrad at steps of 2 ms, and 0.6 at 0.125 ms.
    Signature: position lags by the same angle at every reversal, at any speed.
    Confused with: coulomb_friction, whose hysteresis grows with the compliance around it;
    deadband, which leaves theta where it is while the command moves.
    """

    side = "transmission"
    confused = ("deadband", "coulomb_friction", "hysteresis")
    undamped = True
    parameters = (
        Parameter("width", "rad", null=0.0, nominal=0.02, lower=0.0, upper=0.5).since(
            "gear trains of hobby servos have 0.2 to 2 degrees; ten times that is broken"
        ),
    )

    @staticmethod
    def angle(angle: Jet, tendon: Tendon, values: Values) -> Jet:
        """The drive rests on its command inside the gap."""
        half = real(0.5) * values[0]
        out = angle
        if half > real(0.0):
            if tendon.command >= angle[0] + half:
                out = angle + Jet(half, real(0.0), real(0.0))
            elif tendon.command <= angle[0] - half:
                out = angle - Jet(half, real(0.0), real(0.0))
            else:
                out = Jet(tendon.command, real(0.0), real(0.0))
        return out

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """Nothing is in touch inside the gap."""
        out = force
        if values[0] > real(0.0) and tendon.error == real(0.0):
            out = Jet(real(0.0), real(0.0), real(0.0))
        return out
