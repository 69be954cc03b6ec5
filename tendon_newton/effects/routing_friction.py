"""Tension lost to a tendon wrapped around its guides."""

import warp as wp

from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real
from tendon_newton.effects.loaded_gear import load_side

AT_BOUND = 1.0e-6  # Share of a string's stretch within which it is at a bound of its guide [1]
RELAXED = 1.0e6  # Time [s] after which a string has come to rest in its guide


@device_template
def divides_stretch(tendon: Tendon, values: Values) -> bool:
    """Tell whether a string that pulls stretches on both sides of its guide."""
    return tendon.string > real(0.0) and values[1] > real(0.0) and tendon.side != real(0.0)


@device_template
def at_guide(tendon: Tendon, values: Values) -> Jet:
    """Return the tensions before and behind the guide as shares of a frictionless string's [1].

    The third number is +1 or -1 where the string slides in or out at its guide, 0 where it holds.
    """
    lead = tendon.wound - tendon.length
    ahead = real(1.0) - values[1]
    before = (tendon.wound - values[3]) / ahead
    behind = (values[3] - tendon.length) / values[1]
    ratio = wp.exp(values[0])
    # at a bound, which a sliding string is at when a step begins, its speeds say whether it goes on
    inward = tendon.velocity / ahead + ratio * tendon.rate / values[1]
    outward = -tendon.rate / values[1] - ratio * tendon.velocity / ahead
    near = real(AT_BOUND) * lead
    over = before - ratio * behind
    under = behind - ratio * before
    out = Jet(before / lead, behind / lead, real(0.0))
    if over > near or (over > -near and inward > real(0.0)):
        left = real(1.0) / (ratio * ahead + values[1])
        out = Jet(ratio * left, left, real(1.0))
    elif under > near or (under > -near and outward > real(0.0)):
        left = real(1.0) / (ahead + ratio * values[1])
        out = Jet(left, ratio * left, -real(1.0))
    return out


class RoutingFriction(Effect):
    r"""The capstan equation, with one exponent for the whole path.

    .. math:: T_{out} = T_{in}\,e^{-\mu s},\quad s = \operatorname{sign} v,
        \ s \in [-1, 1] \text{ at } v = 0

    Where a string behind a rotor stretches (`tendon_compliance`), its guide may stand between two
    elastic parts, with a share b of the stretch *behind* it:

    .. math:: T_{in} = \frac{k}{1 - b} (a - x), \quad T_{out} = \frac{k}{b} (x - l), \quad
        e^{-\mu} \le \frac{T_{in}}{T_{out}} \le e^{\mu}

    with a the string wound in, l the excursion, and x what has come through the guide. The guide
    holds any tension between its bounds, and the string slides there only as far as keeps them.
    Without b the guide stands at the mechanism.
    Source: Euler (1769) and Eytelwein (1808); the exponent is friction coefficient times wrap
    angle. Kaneko, Yamashita, Tanie, Basic considerations on transmission characteristics for tendon
    drive robots (1991), for a string that stretches.
    Validity: a limp tendon whose wrap does not change much with the pose; bending stiffness is
    left out.
    Signature: the mechanism lags behind the load cell in proportion to the force, and sticks; with
    a stretch behind the guide the force turns over within a travel after each reversal.
    Confused with: load_dependent_friction (the other side of the load cell) and joint_dry_friction
    (whose friction does not grow with force).
    """

    side = "transmission"
    confused = ("load_dependent_friction", "joint_dry_friction")
    needs_string = True
    dry = ("exponent",)
    memory = Stage.LINE
    memory_parameter = 1
    parameters = (
        Parameter("exponent", "1", null=0.0, nominal=0.1, lower=0.0, upper=1.5).since(
            "a friction coefficient of 0.3 over a wrap of five radians"
        ),
        Parameter(
            "behind",
            "1",
            null=0.0,
            nominal=0.5,
            lower=0.0,
            upper=0.95,
            optional=True,
            needs="tendon_compliance",
        ).since("from a guide at the mechanism to one near the spool"),
    )

    @staticmethod
    def line(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """T_in."""
        out = force
        if divides_stretch(tendon, values):
            place = at_guide(tendon, values)
            out = force * place[0]
            if place[2] == real(0.0):
                out = Jet(out[0], tendon.string / (real(1.0) - values[1]), real(0.0))
        return out

    @staticmethod
    def transmission(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """T_out; what pushes loses as well, and a string never does."""
        if divides_stretch(tendon, values):
            place = at_guide(tendon, values)
            if place[2] == real(0.0):
                return Jet(force[0] * place[1], -tendon.string / values[1], real(0.0))
            return force * place[1]
        return force * wp.exp(-values[0] * load_side(force[0], tendon))

    @staticmethod
    def remember(_force: Jet, tendon: Tendon, values: Values) -> real:
        """The string that has come through the guide; a loose one just hangs there."""
        lead = tendon.wound - tendon.length
        if lead <= real(0.0):
            return wp.clamp(values[3], tendon.wound, tendon.length)
        behind = values[1]
        if divides_stretch(tendon, values) and tendon.elapsed < real(RELAXED):
            place = at_guide(tendon, values)
            behind = behind * place[1]
        return tendon.length + behind * lead
