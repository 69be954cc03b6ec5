r"""Dry friction whose bristles bend before it slides.

A friction law of the catalogue says what is left of a force on one side of a motion: s = +1 while a
tendon winds in, s = -1 while it gives way, and anything between at rest. Bristles that are bent by
a share z pass on what the law leaves at s = z. All dry friction of a tendon, that of its gear and
that of its guides, bends by one share.
"""

import warp as wp

from tendon_newton.device_code.placeholders import HAS_BRISTLES, Jet, ParameterVector, real
from tendon_newton.device_code.slots import sliding_effects, tension_effects, transmission_effects
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.servo import on_side

# Sweeps in which bristles bend at a start: those of a gear and of guides multiply. Four leave a
# thousandth of what they hold
BENDING_SWEEPS = 4


@device_template
def share_of(tendon: Tendon, p: ParameterVector) -> Jet:
    """Return the share by which a tendon's bristles are bent [1], and its slope [1/m]."""
    return sliding_effects(Jet(tendon.direction, real(0.0), real(0.0)), tendon, p)


@device_template
def bends(tendon: Tendon, share: Jet) -> bool:
    """Tell whether bristles are bent by another share than friction that just slides."""
    return share[0] != tendon.direction or share[1] != real(0.0)


@device_template
def far_side(share: Jet) -> real:
    """Return the side [1] that is further away from a share."""
    side = real(1.0)
    if share[0] > real(0.0):
        side = real(-1.0)
    return side


@device_template
def with_bristles(left: Jet, far: Jet, share: Jet) -> Jet:
    """Return what bristles leave of a force [N] with how it grows as they bend.

    The slope is that of the line from the far side, where the law leaves another force.
    """
    by_share = (left[0] - far[0]) / (share[0] - far_side(share))
    return left + Jet(real(0.0), by_share * share[1], real(0.0))


@device_template
def rubbed_gear(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what a gear's dry friction leaves of a force [N]."""
    if wp.static(HAS_BRISTLES):
        share = share_of(tendon, p)
        if bends(tendon, share):
            bent = tendon
            bent.direction = share[0]
            away = on_side(tendon, far_side(share))
            left = tension_effects(force, bent, p)
            far = tension_effects(force, away, p)
            return with_bristles(left, far, share)
    return tension_effects(force, tendon, p)


@device_template
def rubbed_guides(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what the guides' dry friction leaves of a tension [N]."""
    if wp.static(HAS_BRISTLES):
        share = share_of(tendon, p)
        if bends(tendon, share):
            bent = tendon
            bent.direction = share[0]
            away = on_side(tendon, far_side(share))
            left = transmission_effects(force, bent, p)
            far = transmission_effects(force, away, p)
            return with_bristles(left, far, share)
    return transmission_effects(force, tendon, p)
