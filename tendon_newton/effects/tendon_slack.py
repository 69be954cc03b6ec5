"""The tendon is longer than its path."""

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real


class TendonSlack(Effect):
    r"""The spool winds in a length of loose tendon before the mechanism feels anything.

    .. math:: r\,\theta = l + \ell \text{ while taut } (F > 0), \qquad
        \theta = \operatorname{clip}(\theta_d,\ l / r,\ (l + \ell) / r),
        \quad F = 0 \text{ while slack}

    A servo without inertia turns freely to its command while the tendon is loose; a rotor follows
    its own equation of motion there. Friction that holds tension keeps the tendon taut.
    Source: knots and crimps set the length of a tendon to a few millimetres.
    Validity: a limp tendon; the excursion's own zero is that of the mechanism.
    Signature: like an offset of theta while the tendon pulls, and theta on its command while it
    does not.
    Confused with: gravity_misalignment on one weak spring; a second spring or a finger tells.
    """

    side = "transmission"
    confused = ("gravity_misalignment",)
    undamped = True
    needs_string = True
    spool_stages = (Stage.ENCODER,)
    parameters = (
        Parameter("length", "m", null=0.0, nominal=0.002, lower=0.0, upper=0.02).since(
            "more would be seen with the naked eye"
        ),
    )

    @staticmethod
    def angle(angle: Jet, tendon: Tendon, values: Values) -> Jet:
        """The angle of a taut tendon."""
        out = angle
        if values[0] > real(0.0):
            out = angle + Jet(values[0] / tendon.spool_radius, real(0.0), real(0.0))
        return out

    @staticmethod
    def encoder(angle: Jet, tendon: Tendon, values: Values) -> Jet:
        """Without tension the spool rests on its command between the loose and the taut end."""
        out = angle
        loose = angle[0] - values[0] / tendon.spool_radius
        slack = values[0] > real(0.0) and tendon.tension <= real(0.0)
        if slack and tendon.command < angle[0]:
            out = Jet(wp.max(tendon.command, loose), real(0.0), real(0.0))
        return out
