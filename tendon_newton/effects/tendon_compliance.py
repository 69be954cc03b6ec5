"""The tendon is longer under load."""

import math

import warp as wp

from tendon_newton.device_code.first_order_lag import lagged, share_kept
from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real


class TendonCompliance(Effect):
    r"""The tendon stretches like a spring between spool and mechanism.

    .. math:: r\,\theta = l + \frac{F_s}{k}

    The spool gives its string F_s, which is the motor's force less viscous friction. Dry friction
    opposes the excursion l, so it takes its part behind the string: the servo turns while its
    mechanism sticks. With F_s known to first order in theta and theta_dot this is
    :math:`\tau \dot F_s = U - F_s`. The time constant is that of viscous friction against the
    tendon's stiffness, and is zero without friction. The equation is solved exactly over a step,
    around the force before the step. A servo with a rotor needs no such solution: its spool has a
    coordinate of its own.
    Source: Hooke (1678); a braided line of 1 mm and half a metre has 5 to 50 N/mm.
    Validity: linear stretch without creep or mass. Behind a rotor dry friction acts at the spool.
    Signature: theta leads the mechanism in proportion to the force, at rest as well.
    Confused with: spool_radius_error and joint_stiffness_error on one spring alone; two springs
    tell, since the lead goes with the force and not with the position.
    """

    side = "transmission"
    confused = ("spool_radius_error", "joint_stiffness_error")
    undamped = True
    needs_string = True
    memory = Stage.SPOOL_FORCE
    spool_stages = (Stage.STRETCH, Stage.SPOOL_FORCE)
    parameters = (
        Parameter(
            "stiffness", "N/m", null=math.inf, nominal=10000.0, lower=500.0, upper=1000000.0
        ).since("from a long rubber-like cord to a short steel rope"),
    )

    @staticmethod
    def string(stiffness: real, values: Values) -> real:
        """The softer of two strings."""
        return wp.min(stiffness, values[0])

    @staticmethod
    def stretch(length: Jet, tendon: Tendon, values: Values) -> Jet:
        """Add the stretch under the tension before this step."""
        out = length
        if values[3] != real(0.0):
            out = length + Jet(values[3] / values[0], real(0.0), real(0.0))
        return out

    @staticmethod
    def spool_force(force: Jet, tendon: Tendon, values: Values) -> Jet:
        """Solve for the force that stretches the tendon by as much as it lets the servo turn."""
        stiffness = values[0]
        if wp.isinf(stiffness):
            return force
        give = real(1.0) - force[1] / stiffness
        target = (force[0] - force[1] * values[3] / stiffness) / give
        if values[3] == real(0.0) and target < real(0.0):
            return force  # a slack string: what is below zero lets its mechanism go
        rate = (force[1] * tendon.velocity + force[2] * tendon.acceleration) / give
        time_constant = -force[2] / (stiffness * give)
        taken = (real(1.0) - share_kept(tendon.elapsed, time_constant)) / give
        value = lagged(values[3], target, rate, tendon.elapsed, time_constant)
        return Jet(value, taken * force[1], taken * force[2])

    @staticmethod
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """That force; a string cannot push."""
        kept = tendon.least_tension
        if force[0] > kept:
            kept = force[0]
        return kept
