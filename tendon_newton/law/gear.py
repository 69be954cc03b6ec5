r"""What gear and guides leave of a force, and how much of a rotor they pass on.

A rotor of inertia J takes its part before the gear and the load cell see the motor's force:
the tension is :math:`F = f(F_m - a\,\ddot s)`, with :math:`a = J / r^2` and f what the gear's
friction leaves of a force. Friction is linear in the force of a string that pulls, so that two
numbers say how much of the rotor is felt: `Flow.tension_gain` at the load cell, `Flow.pull_gain` at
the mechanism. Where the spool has a coordinate of its own, `spool` takes these apart.
"""

import warp as wp

from tendon_newton.device_code.placeholders import HAS_BRISTLES, Jet, ParameterVector, real
from tendon_newton.device_code.slots import (
    line_effects,
    spool_force_effects,
)
from tendon_newton.device_code.structs import Flow, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.bristles import rubbed_gear, rubbed_guides
from tendon_newton.law.servo import holding_force, is_outrun


@device_template
def after_gear(force: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what friction leaves of a motor's force [N]."""
    driven = tendon
    driven.motor_force = force
    return rubbed_gear(spool_force_effects(force, driven, p), driven, p)


@device_template
def gear_line(force: real, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what gear friction leaves of a force [N], its slope [1], its slope by v [N s/m]."""
    here = after_gear(Jet(force, real(0.0), real(0.0)), tendon, p)
    ahead = after_gear(Jet(force, real(1.0), real(0.0)), tendon, p)
    return Jet(here[0], ahead[1] - here[1], here[2])


@device_template
def bristle_slope(force: real, tendon: Tendon, p: ParameterVector) -> real:
    """Return by how much what a gear leaves of a force grows with the string wound in [N/m]."""
    if wp.static(HAS_BRISTLES):
        return after_gear(Jet(force, real(0.0), real(0.0)), tendon, p)[1]
    return real(0.0)


@device_template
def passed_share(tension: Jet, pull: Jet, tendon: Tendon, p: ParameterVector) -> real:
    """Return by how much the pull at the mechanism grows with the tension behind it [1]."""
    ahead = rubbed_guides(tension + Jet(real(0.0), real(1.0), real(0.0)), tendon, p)
    return ahead[1] - pull[1]


@device_template
def felt_share(force: Jet, line: Jet, tendon: Tendon, p: ParameterVector) -> real:
    """Return by how much what a load cell feels grows with the force of its string [1]."""
    ahead = line_effects(force + Jet(real(0.0), real(1.0), real(0.0)), tendon, p)
    return ahead[1] - line[1]


@device_template
def rotor_flow(flow: Flow, tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the motor's force through gear and guides, and how much of the rotor they pass on.

    A rotor that slows down keeps its string taut while the motor's force is negative. So slack is
    not decided here, but where the acceleration is known. A shaft's gear carries the motor's force
    less what accelerates the rotor (`tendon.carried`). In a fall with the motor off the rotor's
    part is all of it.
    """
    out = flow
    motor = flow.motor_force
    probe = motor[0]
    if tendon.carried != real(0.0):
        probe = tendon.carried
    gear = gear_line(probe, tendon, p)
    value = gear[0] + gear[1] * (motor[0] - probe)
    bending = bristle_slope(probe, tendon, p)
    tension = Jet(value, gear[1] * motor[1] + bending, gear[1] * motor[2] + gear[2])
    gain = gear[1]
    if is_outrun(tendon):
        tension = holding_force(tendon)
        gain = real(0.0)
    out.tension = tension
    out.pull = rubbed_guides(tension, tendon, p)
    out.tension_gain = gain
    out.pull_gain = passed_share(tension, out.pull, tendon, p) * gain
    return out
