"""A rotor between its motor and a string, whose spool moves on its own."""

import warp as wp

from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.slots import speed_effects, string_effects
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.exports.newton.drive_structs import DriveBench
from tendon_newton.exports.newton.grips import GRIP, GRIP_DAMPING, UNBOUNDED
from tendon_newton.law.servo import on_side, servo_flow
from tendon_newton.law.spool import spool_balance

HALVINGS = 60  # Bisections of where a spool comes to rest
SPAN = 10.0  # Turns of a spool [rad] within which a loose one comes to rest


@device_template
def string_stiffness(p: ParameterVector, bench: DriveBench) -> real:
    """Return how stiff the string of a rotor is [N/m]; one without end is as stiff as may be."""
    pace = real(GRIP) / bench.step
    lighter = bench.inertia * bench.rotor / (bench.inertia + bench.rotor)
    return wp.min(string_effects(real(UNBOUNDED), 0, p), lighter * pace * pace)


@device_template
def string_tension(lead: real, rate: real, p: ParameterVector, bench: DriveBench) -> real:
    """Return the tension [N] of a rotor's string whose spool leads by some string [m]."""
    stiffness = string_stiffness(p, bench)
    damping = real(0.0)
    if string_effects(real(UNBOUNDED), 0, p) > stiffness:
        lighter = bench.inertia * bench.rotor / (bench.inertia + bench.rotor)
        damping = real(GRIP_DAMPING) * lighter / bench.step
    tension = real(0.0)
    if lead > real(0.0):
        tension = wp.max(stiffness * lead + damping * rate, real(0.0))
    return tension


@device_template
def seen(tendon: Tendon, wound: real, rate: real, p: ParameterVector, bench: DriveBench) -> Tendon:
    """Return a tendon as its rotor sees it; a string without end does not stretch for it."""
    out = tendon
    lead = wound - tendon.length
    if string_effects(real(UNBOUNDED), 0, p) >= real(UNBOUNDED):
        lead = wp.min(lead, real(0.0))
    out.wound = tendon.length + lead
    out.velocity = rate
    out.angle_rate = Jet(rate, real(0.0), real(1.0)) * tendon.inverse_radius
    return out


@device_template
def spool_net(tendon: Tendon, p: ParameterVector, tension: real, side: real) -> real:
    """Return what accelerates a rotor whose string carries a tension [N]."""
    sliding = on_side(tendon, side)
    flow = servo_flow(sliding, p)
    sliding.error = tendon.command - flow.angle[0]
    spool = spool_balance(flow, sliding, p, Jet(tension, real(0.0), real(0.0)), real(0.0))
    return spool.force[0]


@device_template
def spool_speed(tendon: Tendon, p: ParameterVector, tension: real, bench: DriveBench) -> real:
    """Return a rotor's speed [m/s] after a step; dry friction may hold it."""
    speed = tendon.velocity
    plain = servo_flow(on_side(tendon, real(0.0)), p)
    motor = plain.motor_force
    inertia = bench.rotor + bench.step * wp.max(real(0.0), -motor[2])
    inward = speed + bench.step * spool_net(tendon, p, tension, real(1.0)) / inertia
    outward = speed + bench.step * spool_net(tendon, p, tension, real(-1.0)) / inertia
    after = real(0.0)
    if speed >= real(0.0) and inward > real(0.0):
        after = inward
    if speed <= real(0.0) and outward < real(0.0):
        after = outward
    if speed > real(0.0) and inward < real(0.0):  # stops within the step, and may slide back then
        after = wp.min(real(0.0), (outward - speed) * inward / (inward - speed))
    if speed < real(0.0) and outward > real(0.0):
        after = wp.max(real(0.0), (inward - speed) * outward / (outward - speed))
    if inward == outward:
        after = inward
    most = speed_effects(real(UNBOUNDED), 0, p) * tendon.spool_radius
    return real(wp.clamp(after, -most, most))


@device_template
def resting_lead(tendon: Tendon, p: ParameterVector, bench: DriveBench) -> real:
    """Return by how much a rotor's string [m] leads its mechanism at rest."""
    low = -real(SPAN) * tendon.spool_radius
    high = real(SPAN) * tendon.spool_radius
    for _ in range(HALVINGS):
        lead = real(0.5) * (low + high)
        moved = seen(tendon, tendon.length + lead, real(0.0), p, bench)
        tension = string_tension(lead, real(0.0), p, bench)
        if spool_net(moved, p, tension, real(0.0)) > real(0.0):
            low = lead
        else:
            high = lead
    return real(0.5) * (low + high)
