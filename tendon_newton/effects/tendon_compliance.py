"""The tendon is longer under load."""

import math

import warp as wp

from tendon_newton.effects.base import Effect, Jet, Parameter, Stage, Tendon, Values, real


class TendonCompliance(Effect):
    r"""The tendon stretches like a spring between spool and mechanism.

    .. math:: F = k\,(r\,\theta - l)

    The gear's friction acts at the spool, which sticks while its mechanism moves (`law.string`). A
    servo with a rotor has a coordinate for its spool; without one the spool has no inertia.
    Source: Hooke (1678); a braided line of 1 mm and half a metre has 5 to 50 N/mm.
    Validity: linear stretch without creep or mass.
    Signature: theta leads the mechanism in proportion to the force, at rest as well.
    Confused with: spool_radius_error and joint_stiffness_error on one spring alone; two springs
    tell, since the lead goes with the force and not with the position.
    """

    side = "transmission"
    confused = ("spool_radius_error", "joint_stiffness_error")
    undamped = True
    needs_string = True
    memory = Stage.TENSION
    spool_stages = (Stage.STRETCH, Stage.TENSION)
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
        """What was wound on the spool before this step; without a memory nothing stretches."""
        out = length
        if values[3] != real(0.0):
            out = Jet(values[3], length[1], length[2])
        return out

    @staticmethod
    def remember(force: Jet, tendon: Tendon, values: Values) -> real:
        """What is wound on the spool [m]; a string cannot push."""
        return tendon.wound + wp.max(force[0], tendon.least_tension) / values[0]
