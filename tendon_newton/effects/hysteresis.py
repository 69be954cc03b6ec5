"""Friction that builds up over a travel, and remembers it."""

import warp as wp

from tendon_newton.device_code.templates import device_template
from tendon_newton.device_code.travel import travel
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real

RELAXED = 1.0e6  # Time [s] after which bristles no longer hold anything
ALIKE = 1.0e-3  # Difference of an exponent from 1 below which both are the same [1]


@device_template
def left(before: real, way: real, exponent: real) -> Jet:
    """Return the share of the friction that is still to come, which was `before`, after a way [1].

    It falls as du/dw = -u^n, which is the second number without its sign.
    """
    rest = real(1.0) - exponent
    out = Jet()
    if wp.abs(rest) < real(ALIKE):
        share = before * wp.exp(-way)
        out = Jet(share, wp.max(share, real(0.0)), real(0.0))
    elif before > real(0.0):
        base = wp.pow(before, rest) - rest * way
        if base > real(0.0):
            share = before
            if way != real(0.0):
                share = wp.pow(base, real(1.0) / rest)
            out = Jet(share, share / base, real(0.0))  # base is u^(1 - n)
    return out


@device_template
def bent(before: real, tendon: Tendon, values: Values) -> Jet:
    """Return the friction [N], which was `before`, after the step's travel, and its slope [N/m]."""
    way = travel(tendon)
    side = real(1.0)
    if tendon.velocity < real(0.0):
        side = real(-1.0)
    if way > real(0.0):
        side = real(1.0)
    if way < real(0.0):
        side = real(-1.0)
    missing = real(1.0) - side * before / values[0]
    after = left(missing, side * way / values[1], values[2])
    friction = side * values[0] * (real(1.0) - after[0])
    return Jet(friction, values[0] / values[1] * after[1], real(0.0))


class Hysteresis(Effect):
    r"""Dahl's friction: bristles that bend before they slide.

    .. math::

        F = F_m - F_h, \qquad
        \frac{dF_h}{ds} = \frac{F_C}{x_0} \left(1 - \frac{F_h}{F_C} \operatorname{sign} v\right)^n

    It is solved exactly along a step's travel. With n = 0 bristles bend in proportion until they
    slide, as Prandtl has it; with n = 1 they give way evenly.
    Source: Dahl, A solid friction model (1968); Olsson et al. (1998), eq. 9, with n = 1.
    Validity: no breakaway above the sliding force; it creeps under a force that comes and goes.
    Signature: after each reversal the force turns over within the same travel at any speed;
    positions of rest depend on where the tendon came from.
    Confused with: coulomb_friction, which it becomes as the travel goes to zero; backlash, whose
    gap has no force; viscoelastic_spring, which forgets with time.
    """

    side = "actuator"
    confused = ("backlash", "coulomb_friction", "viscoelastic_spring")
    memory = Stage.TENSION
    includes = ("coulomb_friction",)
    parameters = (
        Parameter("force", "N", null=0.0, nominal=0.8, lower=0.0, upper=8.0).since(
            "as for coulomb_friction"
        ),
        Parameter("travel", "m", null=5.0e-4, nominal=5.0e-4, lower=1.0e-4, upper=2.0e-2).since(
            "from half a degree of a spool of 12.5 mm, below which any dry friction's "
            "bristles bend (5 to 40 um), to the gear of a worn servo"
        ),
        Parameter(
            "exponent", "1", null=1.0, nominal=1.0, lower=0.0, upper=2.0, optional=True
        ).since("Dahl: from 0 for what is brittle to above 1 for what is ductile"),
    )

    @staticmethod
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - F_h."""
        out = force
        if values[0] > real(0.0) and tendon.elapsed < real(RELAXED):
            out = force - bent(values[3], tendon, values)
        return out

    @staticmethod
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """The friction."""
        out = real(0.0)
        if tendon.elapsed < real(RELAXED):
            friction = bent(values[3], tendon, values)
            out = friction[0]
        return out
