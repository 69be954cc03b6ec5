"""A trained force network in place of an equation."""

import warp as wp

from tendon_newton.actuators.actuator_type import (
    Actuator,
    Jet,
    Parameter,
    ParameterVector,
    Tendon,
    real,
)
from tendon_newton.device_code.placeholders import HELD_MEMORY, TENDONS
from tendon_newton.device_code.templates import device_template

AT_REST = 1.0e6  # Time [s] since the last instant, beyond which a world has come to rest for good


@device_template
def hold_answer(p: ParameterVector, angle: Jet, rate: Jet) -> Jet:
    """Return by how much the force [N] falls with the shaft's angle [rad] and rate [rad/s]."""
    return angle * p[0] + rate * p[1]


class Learned(Actuator):
    r"""A network that has learned the force from what the servo was asked and what it did.

    .. math:: F(t) = s\,[F_k - K\,(\theta(t) - \theta_k) - D\,(\dot\theta(t) - \dot\theta_k)],
        \qquad t_k \le t < t_{k+1}

    .. math:: F_k = f(o_{k-H+1}, \dots, o_k), \qquad o_k = (\theta_d, \theta, \dot\theta)(t_k)

    The network is asked at its own rate; in between, the force answers to the shaft as a motor
    does, and stays in [0, F_max]. With K = D = 0 it is held, as in the paper. K and D stand on the
    network's card; a model file may give others. With both at zero a simulation suffers: a light
    mechanism moves far within 50 ms, and a motor's back-EMF that acts so late is no brake but a
    push. The factor s is 1, and in a world with a stronger or weaker servo another number. The
    whole force of a servo grows with its motor's constant.

    The other stages keep their places. Effects on the command (command_delay) or on the position
    error (gain_error, deadband) act on the :math:`\theta_d` that the network is shown, since a
    network has no gain to change. The servo's limit, lags and frictions act on the network's force,
    which for a network of motor forces may be negative. A friction that the network has learned
    already must not be listed again.

    Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-B:
    H = 30 samples at 20 Hz, held.
    """

    parameters = (
        Parameter("hold_stiffness", "N/rad", null=0.0, nominal=6.0, lower=0.0, upper=1000.0).since(
            "fitted to train recordings; the virtual bench has 6.3 N/rad"
        ),
        Parameter("hold_damping", "N s/rad", null=0.0, nominal=10.0, lower=0.0, upper=1000.0).since(
            "the same fit; 10.6 N s/rad there, which is back-EMF"
        ),
        Parameter("force_scale", "1", null=1.0, nominal=1.0, lower=0.0, upper=10.0).since(
            "servos of one type differ by a tenth; none is ten times as strong"
        ),
    )
    held = True

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """F = s (F_k - K (theta - theta_k) - D (theta_dot - theta_dot_k)); at rest F = s F_k."""
        place = wp.static(HELD_MEMORY) + tendon.index
        held = Jet(tendon.memory[place], real(0.0), real(0.0))
        if tendon.elapsed < real(AT_REST):
            angle = Jet(tendon.command - tendon.error, tendon.inverse_radius, real(0.0))
            since = Jet(tendon.memory[place + TENDONS], real(0.0), real(0.0))
            held = held + since - hold_answer(p, angle, tendon.angle_rate)
        return held * p[2]
