"""What a tendon's drive does in one step, as device code that an exported file carries along.

The drive is explicit: Newton asks for a force at the start of a step. Two things would need the
forces of the step to come, and are stiff springs in place of that. Dry friction bends before it
slides, and a string between a rotor and its mechanism stretches. Both are as stiff as the step and
the mechanism's inertia allow, so that both errors fall with the step.
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_ROTOR,
    Jet,
    MemoryVector,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import encoder_effects
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.exports.newton.drive_spools import (
    resting_lead,
    seen,
    spool_speed,
    string_tension,
)
from tendon_newton.exports.newton.drive_structs import DriveAnswer, DriveBench, Kept
from tendon_newton.exports.newton.grips import bent_on, bent_share, held_back, outrun_by, rebent
from tendon_newton.law.bristles import rubbed_guides
from tendon_newton.law.gear import gear_line, passed_share
from tendon_newton.law.servo import on_side, servo_flow
from tendon_newton.law.spool import SETTLED
from tendon_newton.law.string import renewed_memory, tendon_flow

RELAXATIONS = 3  # How often memories and spool are brought to rest in turn


@device_template
def renewed_on(tendon: Tendon, p: ParameterVector, side: real) -> MemoryVector:
    """Return what the effects remember of a tendon that slid on a side."""
    return renewed_memory(on_side(tendon, side), p, tendon.memory)


@device_template
def at_rest(tendon: Tendon, p: ParameterVector, bench: DriveBench) -> Kept:
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
def freely_answered(
    tendon: Tendon, here: Tendon, p: ParameterVector, before: Kept, now: Kept, bench: DriveBench
) -> DriveAnswer:
    """Return what a drive gives and remembers whose spool moves on its own.

    The tendon here is as its spool is; what is remembered now has its memory, command and time.
    """
    out = DriveAnswer()
    kept = now
    rate = before.wound_rate
    lead = before.wound - tendon.length
    out.tension = string_tension(lead, rate - tendon.velocity, p, bench)
    kept.wound_rate = spool_speed(here, p, out.tension, bench)
    kept.wound = before.wound + bench.step * kept.wound_rate
    out.spool_change = (kept.wound_rate - rate) / bench.step
    way = real(1.0)
    if rate + kept.wound_rate < real(0.0):  # what rests begins to slide in this step
        way = real(-1.0)
    sliding = on_side(here, way)
    flow = servo_flow(sliding, p)
    sliding.error = tendon.command - flow.angle[0]
    gear = gear_line(out.tension, sliding, p)
    out.tension_gain = gear[1]
    if gear[1] == real(0.0) and lead >= real(0.0):  # inside a gap the string is all that moves
        out.tension = real(0.0)
        kept.wound_rate = tendon.velocity
        kept.wound = tendon.length + bench.step * tendon.velocity
    given = Jet(out.tension, real(0.0), real(0.0))
    inward = rubbed_guides(given, on_side(here, real(1.0)), p)
    outward = rubbed_guides(given, on_side(here, real(-1.0)), p)
    half = real(0.5) * (outward[0] - inward[0])
    bend = rebent(before, inward[0], half, bench)
    kept.share = bent_share(bend, tendon.velocity, half, bench.inertia, bench.step)
    kept.bend = bent_on(bend, tendon.velocity, half, bench.inertia, bench.step)
    out.pull = inward[0] + kept.share * (outward[0] - inward[0])
    kept.pull = out.pull
    least_gain = passed_share(given, inward, on_side(here, real(1.0)), p)
    most_gain = passed_share(given, outward, on_side(here, real(-1.0)), p)
    out.pull_gain = least_gain + kept.share * (most_gain - least_gain)
    out.kept = kept
    return out


@device_template
def tightly_answered(
    tendon: Tendon, here: Tendon, p: ParameterVector, before: Kept, now: Kept,
    acceleration: real, bench: DriveBench,
) -> DriveAnswer:  # fmt: skip
    """Return the same of one whose spool follows its string, which accelerates at a rate [m/s2]."""
    out = DriveAnswer()
    kept = now
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
        out.pull = out.pull + (real(1.0) - gain) * bench.rotor * acceleration
        cell_gain = kept.share * (most.tension_gain - least.tension_gain)
        out.tension_gain = least.tension_gain + cell_gain
    out.kept = kept
    return out


@device_template
def answered(tendon: Tendon, p: ParameterVector, before: Kept, bench: DriveBench) -> DriveAnswer:
    """Return what a drive gives from now on, and what it remembers then.

    The tendon is under the new command; its memory is the one before.
    """
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
    pulled_in = renewed_on(past, p, real(1.0))
    here.memory = pulled_in + (renewed_on(past, p, real(-1.0)) - pulled_in) * before.share
    if wp.static(HAS_ROTOR and not FREE_SPOOL):
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
        out = freely_answered(tendon, here, p, before, kept, bench)
    else:
        out = tightly_answered(tendon, here, p, before, kept, past.acceleration, bench)
    return reported(out, here, p)


@device_template
def reported(answer: DriveAnswer, tendon: Tendon, p: ParameterVector) -> DriveAnswer:
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
