"""Friction of a gear under load: which way it acts, and what it takes."""

from tendon_newton.device_code.placeholders import Jet, real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template


@device_template
def load_side(outcome: real, tendon: Tendon) -> real:
    """Return +1 where the motor drives its load, and -1 where the load drives the motor.

    A string pulls, whatever is left of the motor's force. A shaft is loaded on the side of what is
    left [N].
    """
    side = tendon.direction
    if tendon.least_tension != real(0.0) and outcome < real(0.0):
        side = -side
    return side


@device_template
def gear_loaded(force: Jet, coefficient: real, tendon: Tendon) -> Jet:
    """Return what is left of a motor's force F_m by friction K |F_m + F| beside all other [N].

    `force` [N] is what the other friction leaves of F_m; the coefficient is K [1].
    """
    motor = tendon.motor_force
    opposing = coefficient * load_side(force[0] + motor[0], tendon)
    return (force - motor * opposing) * (real(1.0) / (real(1.0) + opposing))
