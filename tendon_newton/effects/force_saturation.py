"""The servo gives up earlier than the model says."""

from __future__ import annotations

import math

import warp as wp

from tendon_newton.data.parameters import Parameter
from tendon_newton.device_code.placeholders import Jet, Values, real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.effects.base import Effect


class ForceSaturation(Effect):
    r"""The motor's force is limited either way.

    .. math:: F_m \to \operatorname{clip}(F_m, \pm F_{max})

    Source: current limits in firmware, or a supply that cannot give more.
    Validity: a hard limit that does not depend on speed; see speed_limit and voltage_sag.
    Signature: force stays at one height while the position error grows; below it nothing is wrong.
    Confused with: speed_limit and obstruction in single steps; ramps into the limit tell.
    """

    name = "force_saturation"
    side = "actuator"
    parameters = (
        Parameter(
            name="limit",
            unit="N",
            null=math.inf,
            nominal=10.0,
            lower=0.5,
            upper=100.0,
            source="from a tenth to five times what a small servo gives",
        ),
    )

    @staticmethod
    @device_template
    def motor_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """Cut the force off at the limit, where it does not depend on anything any more."""
        out = force
        if wp.abs(force[0]) > values[0]:
            out = Jet(wp.sign(force[0]) * values[0], real(0.0), real(0.0))
        return out
