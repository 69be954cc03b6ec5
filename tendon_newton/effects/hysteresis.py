"""Friction that builds up over a travel, and remembers it."""

from __future__ import annotations

import warp as wp

from tendon_newton.data.parameters import Parameter
from tendon_newton.device_code.placeholders import Jet, Values, real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect, Stage


@device_template
def bent(before: real, tendon: Tendon, values: Values) -> Jet:
    """Return the friction [N], which was `before`, after the step's travel, and its slope [N/m]."""
    mean = tendon.velocity - real(0.5) * tendon.acceleration * tendon.elapsed
    travel = mean * tendon.elapsed
    side = real(1.0)
    if tendon.velocity < real(0.0):
        side = real(-1.0)
    if travel > real(0.0):
        side = real(1.0)
    if travel < real(0.0):
        side = real(-1.0)
    level = side * values[0]
    kept = wp.exp(-side * travel / values[1])
    away = (before - level) * kept
    return Jet(level + away, -side * away / values[1], real(0.0))


class Hysteresis(Effect):
    r"""Dahl's friction: bristles that bend before they slide.

    .. math:: F = F_m - F_h, \qquad
        \frac{dF_h}{ds} = \frac{F_C - F_h \operatorname{sign} v}{x_0}

    It is solved exactly along a step's travel.
    Source: Dahl, A solid friction model (1968), with the exponent 1; Olsson et al. (1998), eq. 9.
    Validity: no breakaway above the sliding force; it creeps under a force that comes and goes.
    Signature: after each reversal the force turns over within the same travel at any speed;
    positions of rest depend on where the tendon came from.
    Confused with: coulomb_friction, which it becomes as the travel goes to zero; backlash, whose
    gap has no force; viscoelastic_spring, which forgets with time.
    """

    name = "hysteresis"
    side = "actuator"
    memory = Stage.TENSION
    includes = ("coulomb_friction",)
    parameters = (
        Parameter(
            name="force",
            unit="N",
            null=0.0,
            nominal=0.8,
            lower=0.0,
            upper=8.0,
            source="as for coulomb_friction",
        ),
        Parameter(
            name="travel",
            unit="m",
            null=5.0e-4,
            nominal=5.0e-4,
            lower=1.0e-4,
            upper=2.0e-2,
            source="from half a degree of a spool of 12.5 mm, below which any dry friction's "
            "bristles bend (5 to 40 um), to the gear of a worn servo",
        ),
    )

    @staticmethod
    @device_template
    def tension(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """F = F_m - F_h."""
        out = force
        if values[0] > real(0.0):
            out = force - bent(values[3], tendon, values)
        return out

    @staticmethod
    @device_template
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """The friction."""
        out = real(0.0)
        if tendon.elapsed < real(1.0e6):
            friction = bent(values[3], tendon, values)
            out = friction[0]
        return out
