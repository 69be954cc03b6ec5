"""Bristles that bend before dry friction slides."""

import warp as wp

from tendon_newton.device_code.templates import device_template
from tendon_newton.device_code.travel import travel
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real

RELAXED = 1.0e6  # Time [s] after which bristles are as relaxed as the friction that bends them


@device_template
def bent(before: real, tendon: Tendon, values: Values) -> Jet:
    """Return the share by which bristles are bent, which was `before`, and its slope [1/m]."""
    way = travel(tendon)
    side = real(1.0)
    if way < real(0.0) or (way == real(0.0) and tendon.velocity < real(0.0)):
        side = real(-1.0)
    left = (side - before) * wp.exp(-side * way / values[0])
    return Jet(side - left, side * left / values[0], real(0.0))


class Presliding(Effect):
    r"""Bristles between all surfaces that rub: they bend over a travel before friction slides.

    .. math::

        F = F(s = z), \qquad \frac{dz}{d|w|} = \frac{\operatorname{sign} v - z}{x_0}

    with what the model's dry friction leaves of a force on a side s of the motion, and the way w.
    It is solved exactly along a step's travel. Without dry friction it does nothing. A diagnosis
    fits what any gear has of it beside the stated numbers, and names what is more.
    Source: Dahl, A solid friction model (1968); Canudas de Wit et al., A new model for control of
    systems with friction (1995), whose bristles carry every form of dry friction.
    Validity: bristles without damping of their own. Behind a string that stretches and has no rotor
    a gear's friction sticks as before; its string is the softer of both.
    Signature: what stands still gives way by microns in proportion to the force; against a stop,
    where nothing travels, the load cell reads a servo's force without the friction.
    Confused with: hysteresis, which is one constant friction with bristles; tendon_compliance,
    whose string gives way in motion as well; backlash, whose gap has no force.
    """

    side = "actuator"
    confused = ("hysteresis", "tendon_compliance", "backlash")
    smooth = ("travel",)
    memory = Stage.MOTOR_FORCE
    parameters = (
        Parameter(
            "travel", "m", null=0.0, nominal=1.0e-4, lower=0.0, upper=2.0e-2, tolerance=1.0e-4
        ).since(
            "steel bends by 5 to 40 um; any gear may give way by half a degree of a spool of "
            "12.5 mm, a worn one by far more"
        ),
    )

    @staticmethod
    def sliding(side: Jet, tendon: Tendon, values: Values) -> Jet:
        """The share z."""
        out = side
        if values[0] > real(0.0) and side[0] != real(0.0) and tendon.elapsed < real(RELAXED):
            out = bent(values[3], tendon, values)
        return out

    @staticmethod
    def remember(_force: Jet, tendon: Tendon, values: Values) -> real:
        """The share z."""
        out = tendon.direction
        if values[0] > real(0.0) and tendon.elapsed < real(RELAXED):
            share = bent(values[3], tendon, values)
            out = share[0]
        return out
