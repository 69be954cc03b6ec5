r"""From the encoder to the mechanism, while no rotor gives a spool a motion of its own.

A string that stretches lies between spool and mechanism (`tendon_compliance`). The gear's dry
friction f acts at the spool: what the spool gives, U less f, is what the string carries,
:math:`F = k (r \theta - l)`. So the spool sticks while F lies between the two forces at which it
would slide, and else it slides. With U known to first order in theta and theta_dot a sliding spool
has :math:`\tau \dot F = U - f - F`, where tau is viscous friction over the string's stiffness.
Source: Prandtl's element of a spring and a slider in series (1928).
"""

import warp as wp

from tendon_newton.device_code.first_order_lag import lagged, share_kept
from tendon_newton.device_code.placeholders import (
    HAS_ROTOR,
    Jet,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import (
    duty_memory,
    error_memory,
    line_memory,
    motor_force_memory,
    spool_force_effects,
    stretch_effects,
    string_effects,
    tension_effects,
    tension_memory,
)
from tendon_newton.device_code.structs import Flow, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.device_code.travel import travel
from tendon_newton.law.bristles import rubbed_gear, rubbed_guides
from tendon_newton.law.gear import rotor_flow
from tendon_newton.law.servo import holding_force, is_outrun, on_side, servo_flow
from tendon_newton.law.spool import UNBOUNDED

# Whether a string pulls: what its force says, or what was decided at the start of a step
UNDECIDED, TAUT, SLACK = 0.0, 1.0, 2.0
# Time [s] after its start at which a step is asked whether the spool slides: at the start itself a
# sliding one is at the very edge of sticking. Long beside rounding, short beside any step
AHEAD = 1.0e-5
LOOSE = 1.0e-8  # Stretch [m] below which a string may be slack: what rounding leaves


@device_template
def carried(given: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
    """Return what a string carries [N] of what its spool gives it before dry friction."""
    stiffness = string_effects(real(UNBOUNDED), tendon.index, p)
    out = Jet()
    if stiffness >= real(UNBOUNDED):
        out = rubbed_gear(given, tendon, p)
    else:
        side = real(1.0)
        if tendon.direction == real(0.0):  # without friction
            side = real(0.0)
        winding = on_side(tendon, side)
        giving_way = on_side(tendon, -side)
        least = tension_effects(given, winding, p)
        most = tension_effects(given, giving_way, p)
        if least[0] == most[0]:
            out = stretched(least, tendon, p, stiffness, real(0.0))
        else:
            out = stretched(least, tendon, p, stiffness, real(1.0))
            if out[1] == -stiffness:  # it does not wind in
                out = stretched(most, tendon, p, stiffness, real(-1.0))
    return out


@device_template
def stretched(
    force: Jet, tendon: Tendon, p: ParameterVector, stiffness: real, direction: real
) -> Jet:
    """Return what a string carries [N] whose spool gives it a force, friction taken off.

    The equation is solved exactly over a step, around where the spool was before it.

    Args:
        force: What the spool would give if it stayed where it was [N].
        tendon: The tendon.
        p: The world's numbers.
        stiffness: Of the string [N/m].
        direction: +1 where the spool winds in or sticks, -1 where it gives way or sticks, 0 where
            nothing makes it stick.
    """
    stuck = stiffness * stretch_of(tendon, p)
    before = stuck + stiffness * travel(tendon)
    give = real(1.0) - force[1] / stiffness
    target = (force[0] - force[1] * stuck / stiffness) / give
    still = target - force[2] * tendon.velocity / give  # of a spool that does not turn
    coming = real(0.0)
    if tendon.elapsed == real(0.0):
        coming = stiffness * tendon.velocity * real(AHEAD)
    if direction != real(0.0) and direction * (still - stuck + coming) <= real(0.0):
        return Jet(stuck, -stiffness, real(0.0))
    if before < stiffness * real(LOOSE) and target < real(0.0):
        return force  # a slack string: what is below zero lets its mechanism go
    rate = (force[1] * tendon.velocity + force[2] * tendon.acceleration) / give
    time_constant = -force[2] / (stiffness * give)
    value = lagged(before, target, rate, tendon.elapsed, time_constant)
    taken = (real(1.0) - share_kept(tendon.elapsed, time_constant)) / give
    return Jet(value, taken * force[1], taken * force[2])


@device_template
def stretch_of(tendon: Tendon, p: ParameterVector) -> real:
    """Return how far a string is stretched [m] while its spool stays where a step began."""
    return stretch_effects(Jet(tendon.wound, real(1.0), real(0.0)), tendon, p)[0] - tendon.wound


@device_template
def with_spool_rate(tendon: Tendon, p: ParameterVector, tension: real) -> Tendon:
    """Return a tendon with the mean velocity of its spool in a step that led to a tension."""
    out = tendon
    stiffness = string_effects(real(UNBOUNDED), tendon.index, p)
    if stiffness < real(UNBOUNDED) and tendon.elapsed > real(0.0):
        turned = tension / stiffness - stretch_of(tendon, p)
        out.velocity = turned / tendon.elapsed
        out.acceleration = real(0.0)
    return out


@device_template
def tendon_flow(tendon: Tendon, p: ParameterVector) -> Flow:
    """Follow the signal from the encoder through servo and tendon to the mechanism."""
    flow = servo_flow(tendon, p)
    acting = tendon
    acting.error = tendon.command - flow.angle[0]
    if wp.static(HAS_ROTOR):
        flow = rotor_flow(flow, acting, p)
    else:
        acting.motor_force = flow.motor_force
        flow.tension = carried(spool_force_effects(flow.motor_force, acting, p), acting, p)
        flow.slack = tendon.slack
        if is_outrun(tendon):
            flow.tension = holding_force(tendon)
            flow.slack = real(UNDECIDED)
        flow.line = flow.tension[0]
        if flow.slack == real(UNDECIDED):
            flow.slack = real(TAUT)
            if flow.tension[0] < tendon.least_tension:
                flow.slack = real(SLACK)
        if flow.slack == real(SLACK):
            flow.tension = Jet(tendon.least_tension, real(0.0), real(0.0))
        flow.pull = rubbed_guides(flow.tension, acting, p)
    return flow


@device_template
def renewed_memory(tendon: Tendon, p: ParameterVector, memory: MemoryVector) -> MemoryVector:
    """Renew what the effects along one tendon remember."""
    flow = tendon_flow(tendon, p)
    memory = error_memory(flow.error, tendon, p, memory)
    memory = duty_memory(flow.duty, tendon, p, memory)
    memory = motor_force_memory(flow.motor_force, tendon, p, memory)
    if wp.static(HAS_ROTOR):
        memory = line_memory(flow.tension, tendon, p, memory)
        memory = tension_memory(flow.tension, tendon, p, memory)
    else:
        turning = with_spool_rate(tendon, p, flow.tension[0])
        memory = tension_memory(flow.tension, turning, p, memory)
    return memory
