"""A trained force network in place of an equation."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.actuators.base import Actuator
from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.templates import device_template

HELD_MEMORY = 0
"""Where the held forces stand in a world's memory."""


class Learned(Actuator):
    r"""A network that has learned the force from what the servo was asked and what it did.

    .. math:: F(t) = \operatorname{clip}\left(f(o_{k-H+1}, \dots, o_k), 0, F_{max}\right), \qquad
        o_k = (\theta_d, \theta, \dot\theta)(t_k), \qquad t_k \le t < t_{k+1}

    The network is asked at its own rate; its force is held in between. The other stages stay where
    they are: what acts on the command (command_delay) or on the position error (gain_error,
    deadband) acts on the :math:`\theta_d` that the network is shown, since a network has no gain
    that they could change; the servo's limit, lags and frictions act on the force that it gives.
    A friction that the network has learned already must not be listed again.

    Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-B:
    H = 30 samples at 20 Hz.
    """

    name = "learned"
    parameters = ()
    held = True

    @staticmethod
    @device_template
    def force(error: Jet, tendon: Any, p: ParameterVector) -> Jet:
        """The force that the network gave last; it answers to nothing until the next query."""
        place = wp.static(HELD_MEMORY) + tendon.index
        return Jet(tendon.memory[place], real(0.0), real(0.0))

    @staticmethod
    @device_template
    def armature(p: ParameterVector) -> real:
        """What the rotor's inertia does to the force, the network has learned with the rest."""
        return real(0.0)
