"""The nominal servo where only positions are known: it is where it was told to be."""

from __future__ import annotations

from collections.abc import Mapping

from tendon_newton.actuators.actuator_type import Actuator
from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template


class IdealPosition(Actuator):
    r"""A servo whose shaft follows its command at once, whatever it carries.

    .. math:: \theta = \theta_d

    For a bench whose load is unknown, so that no force can be computed. Effects act on the
    position: a delay of the command, a lag, a deadband, play, a bound on speed, an offset.

    Source: what a simulation without actuator models assumes of a position-controlled joint.
    """

    name = "ideal_position"
    parameters = ()
    kinematic = True

    @classmethod
    def static_force(cls, values: Mapping[str, float | str], error: float, radius: float) -> float:
        """None is known."""
        return 0.0

    @staticmethod
    @device_template
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """None is known."""
        return Jet(real(0.0), real(0.0), real(0.0))

    @staticmethod
    @device_template
    def armature(p: ParameterVector) -> real:
        """None is known."""
        return real(0.0)
