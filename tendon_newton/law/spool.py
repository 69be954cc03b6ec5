r"""A spool that turns on its own: a rotor whose string carries a tension of its own.

The gear gives the string what friction leaves of the motor's force and the rotor's inertia,
:math:`F = f(F_m - a\,\ddot s)` with :math:`a = J / r^2`, so that

.. math:: a\,\ddot s = F_m - f^{-1}(F)

Source: Newton's law.
"""

import warp as wp

from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.slots import armature
from tendon_newton.device_code.structs import Flow, Spool, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.gear import bristle_slope, gear_line
from tendon_newton.law.servo import holding_force, is_outrun

# Inertia [kg m2] of the smallest rotor: that of a coreless motor of 10 mm without a gear
LEAST_ROTOR = 1.0e-8
UNBOUNDED = 1.0e30  # Stands for an infinite number where one must be compared: a speed, a stiffness
SETTLED = 1.0e9  # Time [s] after which every internal state has come to rest


@device_template
def felt_inertia(radius: real, p: ParameterVector) -> real:
    """Return the inertia of a rotor as felt at its string, J / r^2 [kg]."""
    return wp.max(armature(p), real(LEAST_ROTOR)) / (radius * radius)


@device_template
def spool_balance(
    flow: Flow, tendon: Tendon, p: ParameterVector, tension: Jet, stiffness: real
) -> Spool:
    """Return what accelerates a rotor whose string carries a tension [N] by the string wound in.

    It carries more by a stiffness [N/m] as its spool's lead grows.
    """
    motor = flow.motor_force
    gear = gear_line(tension[0], tendon, p)
    out = Spool()
    out.force = motor
    if gear[1] > real(0.0):  # else inside a gap, where nothing is in touch
        taken = tension[0] + (tension[0] - gear[0]) / gear[1]
        by_wound = motor[1] - (tension[1] - bristle_slope(tension[0], tendon, p)) / gear[1]
        out.force = Jet(motor[0] - taken, by_wound, motor[2] + gear[2] / gear[1])
        out.force_by_lead = -stiffness / gear[1]
    if is_outrun(tendon):
        out.force = holding_force(tendon)
        out.force_by_lead = real(0.0)
    return out
