"""What a tendon's drive does in one step, as device code that an exported file carries along.

The drive is explicit: Newton asks for a force at the start of a step. Two things would need the
forces of the step to come, and are stiff springs in place of that. Dry friction bends before it
slides, and a string between a rotor and its mechanism stretches. Both are as stiff as the step and
the mechanism's inertia allow, so that both errors fall with the step.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_ROTOR,
    Jet,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import (
    duty_memory,
    encoder_effects,
    error_memory,
    motor_force_memory,
    speed_effects,
    string_effects,
    tension_memory,
)
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import device_struct, device_template
from tendon_newton.simulation.tendons.pipeline import (
    gear_line,
    guide_line,
    servo_flow,
    tendon_flow,
)

GRIP = 0.3
"""Turns [rad] that a stiff spring's oscillation may take in one step."""
GRIP_DAMPING = 0.42
"""Share of an inertia's momentum [1] that its damper takes in one step: seven tenths critical."""
HALVINGS = 60
"""Bisections of where a spool comes to rest."""
SETTLED = 1.0e9
"""Time [s] after which every internal state has come to rest."""
OUTRUN = 4.0
"""What a motor at its greatest speed holds against, in shares of its greatest force [1]."""
UNBOUNDED = 1.0e30
STUCK = 1.0e-3
"""Share of its span [1] by which friction that sticks is away from sliding."""
DRAWS = 1.0e-6
"""A force [N] whose sign is that of a string that pulls."""
SPAN = 10.0
"""Turns of a spool [rad] within which a loose one comes to rest."""
RELAXATIONS = 3
"""How often memories and spool are brought to rest in turn."""


@device_struct
class Kept:
    """What a drive remembers of one tendon."""

    memory: MemoryVector
    """Of the effects."""
    bend: real
    """How far dry friction has bent [m]."""
    joint_bend: real
    """The same of the joint [rad, m]."""
    outrun: real
    """How far the tendon has outrun its motor [m]."""
    share: real
    """Where the tendon is between sliding in (0) and out (1)."""
    pull: real
    """On the mechanism one step ago [N]."""
    wound: real
    """String on the spool [m]."""
    wound_rate: real
    """Its rate [m/s]."""
    speed: real
    """Rate of the wound string one step ago [m/s]."""
    command: real
    """Desired motor angle one step ago [rad]."""
    time: real
    """Since the reset [s]."""
    count: int
    """Steps since the reset."""


@device_struct
class Bench:
    """Numbers of one tendon that its drive needs besides the model's."""

    inertia: real
    """Of the mechanism, as felt at the string [kg]."""
    rotor: real
    """Of the motor's rotor, as felt at the string [kg]."""
    joint_inertia: real
    """Of the mechanism, as felt at the joint [kg m2, kg]."""
    step: real
    """[s]."""


@device_struct
class Answer:
    """What a drive gives and reports."""

    kept: Kept
    pull: real
    """On the mechanism [N]."""
    tension: real
    """At the load cell [N]."""
    tension_gain: real
    """Share of a rotor's inertia that the load cell feels [1]."""
    pull_gain: real
    """Share of the tension that the mechanism feels [1]."""
    spool_change: real
    """How the rotor of a string accelerates [m/s2]."""
    angle: real
    """What the encoder reports [rad]."""
    rate: real
    """[rad/s]."""


@device_template
def on_side(tendon: Tendon, side: real) -> Tendon:
    """Return a tendon that slides on a side."""
    out = tendon
    out.side = side
    out.direction = side
    return out


@device_template
def renewed_on(tendon: Tendon, p: ParameterVector, side: real) -> MemoryVector:
    """Return what the effects remember of a tendon that slid on a side."""
    sliding = on_side(tendon, side)
    flow = tendon_flow(sliding, p)
    memory = error_memory(flow.error, sliding, p, tendon.memory)
    memory = duty_memory(flow.duty, sliding, p, memory)
    memory = motor_force_memory(flow.motor_force, sliding, p, memory)
    return tension_memory(flow.tension, sliding, p, memory)


@device_template
def renewed_memory(tendon: Tendon, p: ParameterVector, share: real) -> MemoryVector:
    """Return what the effects remember between two sides."""
    inward = renewed_on(tendon, p, real(1.0))
    outward = renewed_on(tendon, p, real(-1.0))
    return inward + (outward - inward) * share


@device_template
def bent_share(bend: real, speed: real, half: real, inertia: real, step: real) -> real:
    """Return where dry friction of +-half [N] is between sliding in (0) and out (1)."""
    share = real(0.5)
    if half > real(0.0):
        pace = real(GRIP) / step
        force = inertia * (pace * pace * bend + real(GRIP_DAMPING) / step * speed)
        share = real(0.5) * (real(1.0) - wp.clamp(force / half, real(-1.0), real(1.0)))
    return share


@device_template
def bent_on(bend: real, speed: real, half: real, inertia: real, step: real) -> real:
    """Return how far dry friction has bent [m] a step later."""
    pace = real(GRIP) / step
    most = wp.max(half, real(0.0)) / (inertia * pace * pace)
    return wp.clamp(bend + speed * step, -most, most)


@device_template
def rebent(before: Kept, inward: real, half: real, bench: Bench) -> real:
    """Return how far dry friction is bent [m] under a new command.

    What sticks takes up what the motor gives more or less, as far as it can.
    """
    bend = before.bend
    if half > real(0.0) and before.share > real(STUCK) and before.share < real(1.0) - real(STUCK):
        pace = real(GRIP) / bench.step
        share = wp.clamp(real(0.5) * (before.pull - inward) / half, real(0.0), real(1.0))
        bend = (real(1.0) - real(2.0) * share) * half / (bench.inertia * pace * pace)
    return bend


@device_template
def joint_grip(limit: real, joint: Joint, kept: Kept, bench: Bench) -> real:
    """Return what dry friction of a joint gives [N m]."""
    share = bent_share(kept.joint_bend, joint.velocity, limit, bench.joint_inertia, bench.step)
    return (real(2.0) * share - real(1.0)) * limit


@device_template
def outrun_by(before: real, tendon: Tendon, p: ParameterVector, bench: Bench) -> real:
    """Return how far a tendon has outrun its motor [m], which without a rotor has no speed."""
    most = speed_effects(real(UNBOUNDED), p) * tendon.spool_radius
    after = real(0.0)
    if before > real(0.0) or tendon.velocity > most:
        after = wp.max(before + (tendon.velocity - most) * bench.step, real(0.0))
    if before < real(0.0) or tendon.velocity < -most:
        after = wp.min(before + (tendon.velocity + most) * bench.step, real(0.0))
    return after


@device_template
def held_back(outrun: real, tendon: Tendon, p: ParameterVector, bench: Bench) -> real:
    """Return what holds a tendon back that has outrun its motor [N]."""
    most = speed_effects(real(UNBOUNDED), p) * tendon.spool_radius
    force = real(0.0)
    if outrun != real(0.0):
        pace = real(GRIP) / bench.step
        over = tendon.velocity - wp.sign(outrun) * most
        force = bench.inertia * (pace * pace * outrun + real(GRIP_DAMPING) / bench.step * over)
    most_held = real(OUTRUN) * tendon.force_limit
    return real(wp.clamp(force, -most_held, most_held))


@device_template
def string_stiffness(p: ParameterVector, bench: Bench) -> real:
    """Return how stiff the string of a rotor is [N/m]; one without end is as stiff as may be."""
    pace = real(GRIP) / bench.step
    lighter = bench.inertia * bench.rotor / (bench.inertia + bench.rotor)
    return wp.min(string_effects(real(UNBOUNDED), p), lighter * pace * pace)


@device_template
def string_tension(lead: real, rate: real, p: ParameterVector, bench: Bench) -> real:
    """Return the tension [N] of a rotor's string whose spool leads by some string [m]."""
    stiffness = string_stiffness(p, bench)
    damping = real(0.0)
    if string_effects(real(UNBOUNDED), p) > stiffness:
        lighter = bench.inertia * bench.rotor / (bench.inertia + bench.rotor)
        damping = real(GRIP_DAMPING) * lighter / bench.step
    tension = real(0.0)
    if lead > real(0.0):
        tension = wp.max(stiffness * lead + damping * rate, real(0.0))
    return tension


@device_template
def seen(tendon: Tendon, wound: real, rate: real, p: ParameterVector, bench: Bench) -> Tendon:
    """Return a tendon as its rotor sees it; a string without end does not stretch for it."""
    out = tendon
    lead = wound - tendon.length
    if string_effects(real(UNBOUNDED), p) >= real(UNBOUNDED):
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
    loaded = real(wp.max(tension, real(DRAWS)))
    gear = gear_line(loaded, sliding, p)
    taken = real(0.0)
    if gear[1] > real(0.0):
        taken = loaded + (tension - gear[0]) / gear[1]
    motor = flow.motor_force
    return motor[0] - taken


@device_template
def spool_speed(tendon: Tendon, p: ParameterVector, tension: real, bench: Bench) -> real:
    """Return a rotor's speed [m/s] after a step; dry friction may hold it."""
    speed = tendon.velocity
    plain = servo_flow(on_side(tendon, real(0.0)), p)
    motor = plain.motor_force
    inertia = bench.rotor + bench.step * wp.max(real(0.0), -motor[2])
    inward = speed + bench.step * spool_net(tendon, p, tension, real(1.0)) / inertia
    outward = speed + bench.step * spool_net(tendon, p, tension, real(-1.0)) / inertia
    after = real(0.0)
    if inward > real(0.0) and (speed >= real(0.0) or outward > real(0.0)):
        after = wp.max(real(0.0), inward)
        if speed < real(0.0):
            after = real(0.0)
    if outward < real(0.0) and (speed <= real(0.0) or inward < real(0.0)):
        after = outward
        if speed > real(0.0):
            after = real(0.0)
    if inward == outward:
        after = inward
    most = speed_effects(real(UNBOUNDED), p) * tendon.spool_radius
    return real(wp.clamp(after, -most, most))


@device_template
def resting_lead(tendon: Tendon, p: ParameterVector, bench: Bench) -> real:
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


@device_template
def at_rest(tendon: Tendon, p: ParameterVector, bench: Bench) -> Kept:
    """Return what a drive remembers that has been where it is for ever."""
    kept = Kept()
    resting = tendon
    resting.elapsed = real(SETTLED)
    resting.velocity = real(0.0)
    resting.angle_rate = Jet(real(0.0), real(0.0), tendon.inverse_radius)
    kept.memory = tendon.memory
    kept.wound = tendon.length
    kept.share = real(0.5)
    for _ in range(RELAXATIONS):
        resting.memory = kept.memory
        if wp.static(FREE_SPOOL):
            kept.wound = tendon.length + resting_lead(resting, p, bench)
            resting = seen(resting, kept.wound, real(0.0), p, bench)
        kept.memory = renewed_on(resting, p, real(0.0))
    plain = tendon_flow(on_side(resting, real(0.0)), p)
    pulled = plain.pull
    kept.pull = pulled[0]
    kept.wound_rate = tendon.velocity
    kept.speed = tendon.velocity
    kept.command = tendon.command
    return kept


@device_template
def answered(tendon: Tendon, p: ParameterVector, before: Kept, bench: Bench) -> Answer:
    """Return what a drive gives from now on, and what it remembers then.

    Args:
        tendon: Where it is now, under the new command; its memory is the one before.
        p: Numbers of actuator and effects.
        before: What the drive remembered one step ago.
        bench: Numbers of bench and step.
    """
    out = Answer()
    here = tendon
    rate = tendon.velocity
    if wp.static(FREE_SPOOL):
        rate = before.wound_rate
        here = seen(tendon, before.wound, rate, p, bench)
    here.time = before.time
    past = here
    past.elapsed = bench.step
    past.command = before.command
    past.acceleration = (rate - before.speed) / bench.step
    here.memory = renewed_memory(past, p, before.share)
    if wp.static(HAS_ROTOR):
        driven = servo_flow(on_side(here, real(0.0)), p)
        driving = driven.motor_force
        here.carried = driving[0] - bench.rotor * past.acceleration
    kept = before
    kept.memory = here.memory
    kept.command = tendon.command
    kept.speed = rate
    kept.time = before.time + bench.step
    kept.count = before.count + 1
    if wp.static(FREE_SPOOL):
        lead = before.wound - tendon.length
        out.tension = string_tension(lead, rate - tendon.velocity, p, bench)
        kept.wound_rate = spool_speed(here, p, out.tension, bench)
        kept.wound = before.wound + bench.step * kept.wound_rate
        out.spool_change = (kept.wound_rate - rate) / bench.step
        loaded = real(wp.max(out.tension, real(DRAWS)))
        way = real(1.0)
        if rate < real(0.0):
            way = real(-1.0)
        gear = gear_line(loaded, on_side(here, way), p)
        out.tension_gain = gear[1]
        inward = guide_line(out.tension, on_side(here, real(1.0)), p)
        outward = guide_line(out.tension, on_side(here, real(-1.0)), p)
        half = real(0.5) * (outward[0] - inward[0])
        kept.share = bent_share(before.bend, tendon.velocity, half, bench.inertia, bench.step)
        kept.bend = bent_on(before.bend, tendon.velocity, half, bench.inertia, bench.step)
        out.pull = inward[0] + kept.share * (outward[0] - inward[0])
        out.pull_gain = inward[1] + kept.share * (outward[1] - inward[1])
    else:
        least = tendon_flow(on_side(here, real(1.0)), p)
        most = tendon_flow(on_side(here, real(-1.0)), p)
        inward = least.pull
        outward = most.pull
        half = real(0.5) * (outward[0] - inward[0])
        bend = rebent(before, inward[0], half, bench)
        kept.share = bent_share(bend, tendon.velocity, half, bench.inertia, bench.step)
        kept.bend = bent_on(bend, tendon.velocity, half, bench.inertia, bench.step)
        cell = least.tension + (most.tension - least.tension) * kept.share
        kept.outrun = outrun_by(before.outrun, tendon, p, bench)
        held = held_back(kept.outrun, tendon, p, bench)
        out.pull = inward[0] + kept.share * (outward[0] - inward[0]) - held
        out.tension = cell[0] - held
        if tendon.least_tension == real(0.0):
            out.pull = wp.max(out.pull, real(0.0))
            out.tension = wp.max(out.tension, real(0.0))
        kept.pull = out.pull
        out.tension_gain = least.tension_gain
        if wp.static(HAS_ROTOR):
            # the joint's own armature is all of the rotor
            gain = least.pull_gain + kept.share * (most.pull_gain - least.pull_gain)
            out.pull = out.pull + (real(1.0) - gain) * bench.rotor * past.acceleration
            cell_gain = kept.share * (most.tension_gain - least.tension_gain)
            out.tension_gain = least.tension_gain + cell_gain
    out.kept = kept
    return reported(out, here, p)


@device_template
def reported(answer: Answer, tendon: Tendon, p: ParameterVector) -> Answer:
    """Add what the encoder reports."""
    out = answer
    side = real(1.0)
    if tendon.velocity < real(0.0):
        side = real(-1.0)
    sliding = on_side(tendon, side)
    sliding.memory = renewed_on(tendon, p, side)  # a new command may change both at once
    flow = servo_flow(sliding, p)
    sliding.tension = answer.tension
    angle = encoder_effects(flow.angle, sliding, p)
    out.angle = angle[0]
    out.rate = angle[1] * tendon.velocity
    return out
