"""Where a recording starts: in friction-free equilibrium, or at its first row's angle and speed.

A log that begins with a rest shows where friction holds its servo, and a model with dry friction
starts there.

Strings that pull against each other press on the links, and a pressed chain buckles: it may rest in
several places. A recording of several strings starts in the one to which it goes from its first
row's angles.
"""

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_BODY,
    HAS_BRISTLES,
    HAS_MEMORY,
    HELD_MEMORY,
    HOLDS_FORCE,
    JOINTS,
    LINKS,
    ROWS,
    STRIDE,
    TENDONS,
    JointVector,
    MemoryVector,
    ParameterVector,
    RowVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import radius_effects, with_still_body
from tendon_newton.device_code.structs import (
    Commands,
    ContactStates,
    Drive,
    Forces,
    Mechanism,
    States,
    Worlds,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.bristles import BENDING_SWEEPS
from tendon_newton.law.servo import servo_flow
from tendon_newton.law.spool import SETTLED
from tendon_newton.law.string import TAUT
from tendon_newton.simulation.dynamics.events import EDGE
from tendon_newton.simulation.dynamics.forces import smooth_forces, touching
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.tendons.routes import located, tendon_arms
from tendon_newton.simulation.tendons.spools import SNUG, is_rigid, is_string
from tendon_newton.simulation.tendons.states import flow_at, tendon_state
from tendon_newton.simulation.tendons.world_drive import at_start, world_drive

SETTLING_STEPS = 200  # Most steps towards an equilibrium; an asset's finger takes ten to sixty
# Time [s] in which the first step lets inertia answer, and the longest such time
FIRST_PACE, LAST_PACE = 3.0e-3, 10.0
# By which that time grows after a step that went well, and shrinks after one that did not [1]
HASTE, CAUTION = 2.0, 0.4
OVERSHOOT = 0.5  # Share of the torque along a step that may push back at its end [1]
# A step towards equilibrium that is shorter has arrived [rad, m], unless inertia shortened it; one
# that rounding swallows has arrived in any case
STILL = 1.0e-12
# Where a recording starts: in the equilibrium to which it goes from relaxed springs, as its first
# row says, in the equilibrium to which it goes from there, or as measured if friction may hold it
FROM_SPRINGS, AS_MEASURED, NEAR_MEASURED, IF_HELD = 0, 1, 2, 3
# Stiffness [N/m] of the guide that brings a tendon to a measured angle at the start
GUIDE_STIFFNESS = 1.0e6


@device_template
def resting_contact_states(
    mechanism: Mechanism, p: ParameterVector, here: Drive, guided: bool
) -> ContactStates:
    """Return the contact states at rest without dry friction; guided, no motor drives.

    A string that stretches pulls all the same.
    """
    contact = ContactStates()
    contact.touch = touching(mechanism, here.world, here.q, JointVector())
    if guided:
        for r in range(ROWS):
            contact.row_held[r] = real(1.0)
    if wp.static(FREE_SPOOL):
        for d in range(TENDONS):
            if guided and not is_rigid(here, d):
                contact.row_held[TENDONS + d] = real(0.0)
            elif guided or rests_on_string(mechanism, p, here, d):
                contact.joint_held[LINKS + d] = real(1.0)
    return contact


@device_template
def rests_on_string(mechanism: Mechanism, p: ParameterVector, here: Drive, d: int) -> bool:
    """Tell whether a motor at rest pulls on a string that does not stretch."""
    tendon = tendon_state(mechanism, p, here, d, real(0.0))
    flow = servo_flow(tendon, p)
    pulls = here.q[LINKS + d] >= -real(SNUG) and flow.motor_force[0] >= real(0.0)
    return is_rigid(here, d) and (pulls or not is_string(mechanism, here.world, d))


@device_template
def not_beyond_strings(mechanism: Mechanism, drive: Drive, q: JointVector) -> JointVector:
    """Return coordinates in which no spool leads a string that does not stretch."""
    out = q
    if wp.static(FREE_SPOOL):
        for d in range(TENDONS):
            if is_rigid(drive, d) and is_string(mechanism, drive.world, d):
                out[LINKS + d] = wp.min(q[LINKS + d], real(0.0))
    return out


@device_template
def frictionless_forces(
    mechanism: Mechanism,
    p: ParameterVector,
    drive: Drive,
    guided: bool,
    target: TendonVector,
    q: JointVector,
) -> Forces:
    """Return forces at rest without dry friction; guided, a stiff guide replaces the motor.

    A guide pushes no more than its string does: one that stretches is between it and the mechanism.

    The guide's stiffness leaves out how its pull turns with the arms: far from rest that pull is
    that of a thousand servos, and the steps towards rest would follow it anywhere.
    """
    here = located(mechanism, drive, q, JointVector())
    contact = resting_contact_states(mechanism, p, here, guided)
    forces = smooth_forces(mechanism, p, here, contact)
    if guided:
        arms = tendon_arms(mechanism, here)
        torque = forces.torque
        slope = forces.stiffness
        for d in range(TENDONS):
            flow = flow_at(mechanism, p, here, d, real(0.0))
            stiffness = real(GUIDE_STIFFNESS) * mechanism.spool_radius[drive.world][d]
            guide = stiffness * (target[d] - flow.angle[0])
            loose = guide < real(0.0)
            row = arms[d]
            if wp.static(FREE_SPOOL):
                row[LINKS + d] = real(1.0) - contact.joint_held[LINKS + d]
                loose = is_rigid(here, d) and (loose or q[LINKS + d] < -real(SNUG))
            if loose and is_string(mechanism, drive.world, d):
                guide = real(0.0)
                stiffness = real(0.0)
            for i in range(JOINTS):
                torque[i] = torque[i] + row[i] * guide
                for j in range(JOINTS):
                    product = row[i] * row[j]
                    slope[i, j] = slope[i, j] - product * stiffness * flow.angle[1]
        forces.torque = torque
        forces.stiffness = slope
    if wp.static(HAS_BODY):
        forces = with_still_body(forces)
    return forces


@device_template
def with_loose_spools(
    mechanism: Mechanism, p: ParameterVector, drive: Drive, target: TendonVector, x: JointVector
) -> JointVector:
    """Turn spools back to measured angles at which their strings are loose."""
    here = located(mechanism, drive, x, JointVector())
    out = x
    for d in range(TENDONS):
        if is_string(mechanism, drive.world, d) and is_rigid(drive, d):
            tendon = tendon_state(mechanism, p, here, d, real(0.0))
            away = (target[d] - servo_flow(tendon, p).angle[0]) * tendon.spool_radius
            out[LINKS + d] = wp.min(x[LINKS + d] + away, real(0.0))
    return out


@device_template
def measured_speed(
    mechanism: Mechanism, p: ParameterVector, here: Drive, rate: TendonVector
) -> JointVector:
    """Return the least speeds of the joints at which shafts turn at measured rates [rad/s]."""
    arms = tendon_arms(mechanism, here)
    speed = JointVector()
    for d in range(TENDONS):
        radius = radius_effects(mechanism.spool_radius[here.world][d], d, p)
        speed = speed + arms[d] * (rate[d] * radius / wp.dot(arms[d], arms[d]))
    return speed


@device_template
def stepped(mechanism: Mechanism, world: int, q: JointVector, move: JointVector) -> JointVector:
    """Return where a step leads: it is cut to `STRIDE`, and at end stops that it would meet."""
    longest = wp.max(wp.abs(move))
    share = real(1.0)
    if longest > real(STRIDE):
        share = real(STRIDE) / longest
    there = q + share * move
    for j in range(JOINTS):
        upper = mechanism.upper[world][j]
        lower = mechanism.lower[world][j]
        if q[j] <= upper and there[j] > upper + real(EDGE):
            there[j] = upper + real(EDGE)
        if q[j] >= lower and there[j] < lower - real(EDGE):
            there[j] = lower - real(EDGE)
    return there


@device_template
def starts_as_measured(commands: Commands, recording: int, drive: Drive) -> bool:
    """Tell whether a recording starts at measured angles."""
    start = commands.start[recording]
    return start == AS_MEASURED or (start == IF_HELD and drive.dry != real(0.0))


@device_template
def held_by(begun: ContactStates, hold: TendonVector) -> ContactStates:
    """Return contact states in which tendons are held by pulls [N]."""
    contact = begun
    pulls = RowVector()
    for d in range(TENDONS):
        contact.row_held[d] = real(1.0)
        contact.least_side[d] = real(1.0)
        contact.most_side[d] = real(-1.0)
        pulls[d] = hold[d]
    contact.hold = pulls
    return contact


@device_template
def taut(here: Drive) -> Drive:
    """Return a drive whose strings are taut: bristles bend alike, be a string taut or not."""
    out = here
    slack = TendonVector()
    for d in range(TENDONS):
        slack[d] = real(TAUT)
    out.slack = slack
    return out


@device_template
def bent_memory(
    mechanism: Mechanism,
    p: ParameterVector,
    drive: Drive,
    guided: bool,
    target: TendonVector,
    x: JointVector,
) -> MemoryVector:
    """Return what effects remember where bristles are bent as far as it takes to rest there.

    No struct is written after it was read: on its way back a tape would read the later value.
    """
    rest = located(mechanism, drive, x, JointVector())
    here = taut(rest)
    asked = TendonVector()
    least = TendonVector()
    most = TendonVector()
    for d in range(TENDONS):
        flow = flow_at(mechanism, p, rest, d, real(0.0))
        pull = flow.pull[0]
        if guided:
            stiffness = real(GUIDE_STIFFNESS) * mechanism.spool_radius[drive.world][d]
            pull = stiffness * (target[d] - flow.angle[0])
        winding = flow_at(mechanism, p, here, d, real(1.0))
        giving_way = flow_at(mechanism, p, here, d, real(-1.0))
        asked[d] = pull
        least[d] = winding.pull[0]
        most[d] = giving_way.pull[0]
    resting = resting_contact_states(mechanism, p, here, False)
    wanted = asked
    memory = here.memory
    for _sweep in range(wp.static(BENDING_SWEEPS)):
        hold = TendonVector()
        for d in range(TENDONS):
            hold[d] = wp.clamp(wanted[d], least[d], most[d])
        contact = held_by(resting, hold)
        memory = remembered(mechanism, p, here, contact)
        now = at_start(here, here.time, memory)
        missed = TendonVector()
        for d in range(TENDONS):
            flow = flow_at(mechanism, p, now, d, real(1.0))
            missed[d] = asked[d] - flow.pull[0]
        wanted = hold + missed
    return memory


@device_template
def settle_kernel(
    first_world: int, mechanism: Mechanism, worlds: Worlds, commands: Commands, states: States
) -> None:
    """Put each world where its recording starts, every internal state relaxed."""
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    world = worlds.mechanism[i]
    recording = worlds.recording[i]
    first = commands.first[recording]
    p = worlds.parameters[i]
    drive = world_drive(mechanism, world, p)
    drive.voltage = commands.voltage[first]
    drive.enabled = commands.enabled[first]
    drive.command = commands.angle[first]
    drive.elapsed = real(SETTLED)
    if wp.static(HOLDS_FORCE):
        for d in range(TENDONS):
            place = wp.static(HELD_MEMORY) + d
            drive.memory[place] = states.memory[i][place]
    as_measured = starts_as_measured(commands, recording, drive)
    guided = as_measured or commands.start[recording] == NEAR_MEASURED
    target = commands.start_angle[recording]
    x = JointVector()
    rest = JointVector()
    for j in range(JOINTS):
        x[j] = wp.clamp(
            mechanism.rest[world][j], mechanism.lower[world][j], mechanism.upper[world][j]
        )
    pace = real(FIRST_PACE)
    forces = frictionless_forces(mechanism, p, drive, guided, target, x)
    for step in range(2 * SETTLING_STEPS):
        matrix = forces.mass_matrix / (pace * pace) - forces.stiffness
        move = inverse(matrix) * forces.torque
        there = stepped(mechanism, world, x, move)
        there = not_beyond_strings(mechanism, drive, there)
        still = real(STILL)
        if pace < real(1.0):
            still = real(0.0)
        arrived = wp.max(wp.abs(there - x)) <= still
        if arrived and (as_measured or not guided):
            x = there
            break
        if guided and not as_measured and (arrived or step == SETTLING_STEPS):
            guided = False
            pace = real(FIRST_PACE)
            forces = frictionless_forces(mechanism, p, drive, guided, target, x)
            continue
        ahead = frictionless_forces(mechanism, p, drive, guided, target, there)
        work = wp.dot(forces.torque, there - x)
        if work > real(0.0) and wp.dot(ahead.torque, there - x) >= -real(OVERSHOOT) * work:
            x = there
            forces = ahead
            if wp.static(HAS_MEMORY):
                here = located(mechanism, drive, x, rest)
                contact = resting_contact_states(mechanism, p, here, False)
                drive.memory = remembered(mechanism, p, here, contact)
            pace = wp.min(pace * real(HASTE), real(LAST_PACE))
        else:
            pace = pace * real(CAUTION)
    if wp.static(FREE_SPOOL):
        if as_measured:
            x = with_loose_spools(mechanism, p, drive, target, x)
            if wp.static(HAS_MEMORY):
                here = located(mechanism, drive, x, rest)
                contact = resting_contact_states(mechanism, p, here, False)
                drive.memory = remembered(mechanism, p, here, contact)
    if wp.static(HAS_BRISTLES):
        if drive.dry < real(0.0):
            drive.memory = bent_memory(mechanism, p, drive, as_measured, target, x)
    states.q[i] = x
    states.v[i] = rest
    states.memory[i] = drive.memory
    if as_measured:
        end = located(mechanism, drive, x, rest)
        states.v[i] = measured_speed(mechanism, p, end, commands.start_rate[recording])
