"""What divides a step: a row at a speed at which it may be held, a stop, a string, a time met."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    COUNTS,
    FREE_SPOOL,
    HAS_ROTOR,
    HOLDS_ROUTED,
    JOINTS,
    LINKS,
    MAY_HOLD,
    ROUTED,
    ROWS,
    TENDONS,
    Jet,
    JointMatrix,
    JointVector,
    ParameterVector,
    RowMatrix,
    RowVector,
    TendonVector,
    Vec2,
    real,
)
from tendon_newton.device_code.structs import ContactStates, Drive, Event, Mechanism, Motion
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import UNBOUNDED
from tendon_newton.law.string import SLACK, TAUT, UNDECIDED
from tendon_newton.simulation.dynamics.contact_states import (
    BEYOND,
    constrained_solve,
    excursion_rate,
    may_outrun,
    row_bound,
    row_counts,
    sign,
)
from tendon_newton.simulation.dynamics.forces import touching
from tendon_newton.simulation.tendons.routes import located, row_arms
from tendon_newton.simulation.tendons.spools import is_rigid, is_string
from tendon_newton.simulation.tendons.states import flow_at
from tendon_newton.simulation.tendons.world_drive import at_end, in_same_mode

# How far beyond its bound a joint counts as at the edge of its stop, and in touch [rad, m]
EDGE = 1.0e-6
AFTER = 1.0e-6  # How long after a time was met a step is divided [s]: float32 counts to some 1e-7
NOTHING = -1  # Row of an event that brings no row to a speed


@device_template
def speed_range(drive: Drive, d: int, side: real) -> Vec2:
    """Return the least and the greatest rate [m/s] of a tendon that slides on a side."""
    bound = row_bound(drive, d)
    inner = -bound
    if drive.dry > real(0.0):
        inner = real(0.0)
    lower = inner
    upper = bound
    if wp.abs(side) > real(1.5):
        lower = bound
        upper = real(UNBOUNDED)
    if side < real(0.0):
        least = -upper
        upper = -lower
        lower = least
    return Vec2(lower, upper)


@device_template
def too_fast(mechanism: Mechanism, here: Drive, d: int, rate: real) -> bool:
    """Tell whether a row is faster [m/s] than its motor lets it be: a run may begin so."""
    beyond = wp.abs(rate) > row_bound(here, d) * real(BEYOND)
    return beyond and not may_outrun(mechanism, here, d, sign(rate))


@device_template
def crossing(before: real, after: real) -> real:
    """Return the fraction of a step at which a quantity is zero; 0 if its sign never changed."""
    fraction = real(0.0)
    if before * after < real(0.0):
        fraction = before / (before - after)
    return fraction


@device_template
def motion_arms(
    mechanism: Mechanism, here: Drive, contact: ContactStates, motion: Motion
) -> RowMatrix:
    """Return the tendons' rows at the end of a motion [m], shape (R, J)."""
    arms = row_arms(mechanism, here, contact)
    if wp.static(HOLDS_ROUTED):
        arms = motion.arms
    return arms


@device_template
def kept_speeds(
    mechanism: Mechanism, here: Drive, contact: ContactStates, speed: RowVector, end: Motion
) -> Motion:
    """Return the end of a step with its arms, and the held tendons at their speeds [m/s] again."""
    there = located(mechanism, here, end.q, end.v)
    rows = row_arms(mechanism, there, contact)
    v = end.v
    for d in range(ROWS):
        if contact.row_held[d] > real(0.0):
            freed = contact
            freed.row_held[d] = real(0.0)
            v = bring_row(end.mass_matrix, rows[d], v, speed[d], freed, rows)
    out = end
    out.v = v
    out.arms = rows
    return out


@device_template
def first_event(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    end: Motion,
    there: Drive,
    h: real,
) -> Event:
    """Find what ends the contact states first inside a step of h [s].

    `there` is its end where tendons are routed; else it is found here.
    """
    event = Event()
    event.fraction = real(1.0)
    event.row = int(NOTHING)
    event.joint = int(NOTHING)
    event.tendon = int(NOTHING)
    touch = touching(mechanism, here.world, end.q, end.v)
    for j in range(JOINTS):
        if here.friction[j] > real(0.0) and end.v[j] * contact.joint_direction[j] < real(0.0):
            fraction = crossing(here.v[j], end.v[j])
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = j
        if touch[j] != contact.touch[j]:
            fraction = stop_crossing(mechanism, here, j, contact.touch[j] + touch[j], end)
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = int(NOTHING)
                event.joint = j
                event.touch = touch[j]
    if wp.static(MAY_HOLD):
        arms = row_arms(mechanism, here, contact)
        later = motion_arms(mechanism, here, contact, end)
        for d in range(ROWS):
            before = excursion_rate(arms, d, here.v)
            after = excursion_rate(later, d, end.v)
            allowed = speed_range(here, d, contact.row_side[d])
            speed = real(wp.clamp(after, allowed[0], allowed[1]))
            leaves = speed != after and contact.row_held[d] == real(0.0)
            fraction = crossing(before - speed, after - speed)
            if too_fast(mechanism, here, d, before):
                leaves = True
                speed = real(wp.clamp(before, -row_bound(here, d), row_bound(here, d)))
                fraction = real(0.0)
            if leaves and row_counts(contact, d) and fraction < event.fraction:
                event.fraction = fraction
                event.row = JOINTS + d
                event.speed = speed
    if wp.static(FREE_SPOOL):
        for d in range(TENDONS):
            c = LINKS + d
            if caught(mechanism, here, contact, d, end.q) and here.q[c] < real(0.0):
                fraction = crossing(here.q[c], end.q[c])
                if fraction < event.fraction:
                    event.fraction = fraction
                    event.row = c
                    event.joint = int(NOTHING)
                    event.speed = real(0.0)
    if wp.static(not HAS_ROTOR):
        event = first_slack(mechanism, p, here, contact, end, there, h, event)
    for i in range(wp.static(len(COUNTS))):
        lasted = wp.abs(here.memory[wp.static(COUNTS[i][0])])
        fraction = (p[wp.static(COUNTS[i][1])] + real(AFTER) - lasted) / h
        if lasted > real(0.0) and fraction > real(0.0) and fraction < event.fraction:
            event = Event()
            event.fraction = fraction
            event.row = int(NOTHING)
            event.joint = int(NOTHING)
            event.tendon = int(NOTHING)
    return event


@device_template
def first_slack(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    end: Motion,
    there: Drive,
    h: real,
    before: Event,
) -> Event:
    """Return an event, or what comes before it: a string that comes loose or is caught."""
    event = before
    later = there
    if wp.static(not ROUTED):
        later = at_end(here, h, (end.v - here.v) / h)
        later = located(mechanism, later, end.q, end.v)
    for d in range(TENDONS):
        least = mechanism.least_tension[here.world][d]
        if contact.row_held[d] == real(0.0) and least == real(0.0):
            flow = flow_at(mechanism, p, later, d, contact.row_side[d])
            fraction = real(1.0)
            if (end.line[d] < least) != (flow.line < least):
                fraction = crossing(end.line[d], flow.line)
            if fraction > real(0.0) and fraction < event.fraction:
                event.fraction = fraction
                event.row = int(NOTHING)
                event.joint = int(NOTHING)
                event.tendon = d
                event.slack = real(TAUT)
                if flow.line < least:
                    event.slack = real(SLACK)
    return event


@device_template
def after_slack(drive: Drive, event: Event) -> Drive:
    """Return a drive in which the string of an event has come loose or been caught."""
    slack = drive.slack
    for d in range(TENDONS):
        if event.tendon == d:
            slack[d] = event.slack
    return in_same_mode(drive, slack)


@device_template
def caught(
    mechanism: Mechanism, here: Drive, contact: ContactStates, d: int, q: JointVector
) -> bool:
    """Tell whether a spool has wound in all the slack of a string that does not stretch."""
    c = LINKS + d
    loose = contact.joint_held[c] == real(0.0)
    one_way = is_string(mechanism, here.world, d) and is_rigid(here, d)
    return loose and one_way and q[c] > real(0.0)


@device_template
def catch_spools(mechanism: Mechanism, here: Drive, contact: ContactStates, end: Motion) -> Motion:
    """Return the end of a step at which no spool leads a string that does not stretch.

    The string stops it without bounce.
    """
    out = end
    if wp.static(FREE_SPOOL):
        v = end.v
        q = end.q
        arms = motion_arms(mechanism, here, contact, end)
        for d in range(TENDONS):
            if caught(mechanism, here, contact, d, end.q):
                c = LINKS + d
                if v[c] > real(0.0):
                    v = bring_row(end.mass_matrix, joint_row(c), v, real(0.0), contact, arms)
                q[c] = real(0.0)
                out.divided = real(1.0)
        out.q = q
        out.v = v
    return out


@device_template
def without_lead(event: Event, q: JointVector) -> JointVector:
    """Return coordinates in which the spool that an event names leads by nothing."""
    out = q
    for c in range(LINKS, JOINTS):
        if event.row == c:
            out[c] = real(0.0)
    return out


@device_template
def stop_crossing(mechanism: Mechanism, here: Drive, j: int, side: real, end: Motion) -> real:
    """Return the fraction of a step at which joint j meets or leaves a stop (side > 0: upper)."""
    k = mechanism.limit_stiffness[here.world][j]
    c = mechanism.limit_damping[here.world][j]
    bound = mechanism.lower[here.world][j]
    if side > real(0.0):
        bound = mechanism.upper[here.world][j]
    before = here.q[j] - bound
    after = end.q[j] - bound
    if before * side > real(0.0) or after * side <= real(0.0):
        before = (
            k * before + c * here.v[j]
        )  # in touch already, or leaving: the stop's force decides
        after = k * after + c * end.v[j]
    fraction = real(1.0)
    if before * after < real(0.0):
        fraction = crossing(before, after)
    return fraction


@device_template
def after_touch(contact: ContactStates, event: Event) -> ContactStates:
    """Return contact states in which the joint of an event has met or left its end stop."""
    out = contact
    for j in range(JOINTS):
        if event.joint == j and event.row < 0:
            out.touch[j] = event.touch
    return out


@device_template
def bring_row(
    matrix: JointMatrix,
    row: JointVector,
    v: JointVector,
    speed: real,
    contact: ContactStates,
    arms: RowMatrix,
) -> JointVector:
    """Bring the speed along a row to a value [m/s, rad/s] by an impulse; what is held stays so."""
    response = constrained_solve(matrix, row, contact, arms, RowVector())
    admittance = wp.dot(row, response)
    out = v
    if admittance > real(0.0):
        out = v + response * ((speed - wp.dot(row, v)) / admittance)
    return out


@device_template
def bring_event_row(
    mechanism: Mechanism, here: Drive, event: Event, contact: ContactStates, middle: Motion
) -> JointVector:
    """Bring the row that an event names exactly to its speed: the next contact states need that.

    Another tendon may have left its contact state by then, too. Its row is brought to the nearest
    speed that its state allows, so that the next contact states find it there.
    """
    v = middle.v
    arms = motion_arms(mechanism, here, contact, middle)
    for j in range(JOINTS):
        if event.row == j:
            v = bring_row(middle.mass_matrix, joint_row(j), v, event.speed, contact, arms)
    for d in range(ROWS):
        rate = excursion_rate(arms, d, v)
        speed = rate
        slides = contact.row_held[d] == real(0.0) and row_counts(contact, d)
        if wp.static(MAY_HOLD):
            if slides:
                allowed = speed_range(here, d, contact.row_side[d])
                speed = real(wp.clamp(rate, allowed[0], allowed[1]))
        if event.row == JOINTS + d:
            speed = event.speed
        if speed != rate:
            freed = contact
            freed.row_held[d] = real(0.0)
            v = bring_row(middle.mass_matrix, arms[d], v, speed, freed, arms)
    return v


@device_template
def joint_row(j: int) -> JointVector:
    """Return the row of joint j."""
    row = JointVector()
    row[j] = real(1.0)
    return row


@device_template
def holding_joint(contact: ContactStates, j: int) -> ContactStates:
    """Return contact states in which joint j is held too."""
    out = contact
    out.joint_held[j] = real(1.0)
    return out


@device_template
def caught_string(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    end: Motion,
    h: real,
) -> Jet:
    """Return the impulse [N s] of a string that pulls again before the end of a slack h [s].

    Its force had risen evenly from zero since the instant at which it was caught.
    """
    impulse = Jet(real(0.0), real(0.0), real(0.0))
    least = mechanism.least_tension[here.world][d]
    slack = here.slack[d] == real(SLACK)
    if here.slack[d] == real(UNDECIDED):
        slack = end.line[d] < least
    if slack and contact.row_held[d] == real(0.0) and least == real(0.0):
        later = at_end(here, h, (end.v - here.v) / h)
        later = in_same_mode(later, TendonVector())
        later = located(mechanism, later, end.q, end.v)
        flow = flow_at(mechanism, p, later, d, contact.row_side[d])
        if flow.line > least:
            since = h * flow.line / (flow.line - wp.min(end.line[d], real(0.0)))
            impulse = flow.pull * (real(0.5) * since)
    return impulse


@device_template
def pull_row(
    matrix: JointMatrix,
    row: JointVector,
    v: JointVector,
    impulse: Jet,
    contact: ContactStates,
    arms: RowMatrix,
) -> JointVector:
    """Let an impulse [N s] along a row act, implicit in its damping."""
    response = constrained_solve(matrix, row, contact, arms, RowVector())
    brake = real(1.0) + wp.dot(row, response) * wp.max(-impulse[2], real(0.0))
    return v + response * (impulse[0] / brake)


@device_template
def bring_back(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    end: Motion,
    h: real,
) -> Motion:
    """Return the end of a divided step of h [s] with what left its contact state brought back.

    They are second events inside one step. A joint that has run through an end stop is put at its
    edge: the way beyond, which nothing resisted, would come back as energy. A string that would
    pull again does so: under viscous friction a mechanism that was let go would run off at a speed
    that the servo never allows.
    """
    v = end.v
    arms = motion_arms(mechanism, here, contact, end)
    for j in range(JOINTS):
        if here.friction[j] > real(0.0) and v[j] * contact.joint_direction[j] < real(0.0):
            v = bring_row(end.mass_matrix, joint_row(j), v, real(0.0), contact, arms)
            contact = holding_joint(contact, j)
    if wp.static(not HAS_ROTOR):
        for d in range(TENDONS):
            impulse = caught_string(mechanism, p, here, contact, d, end, h)
            if impulse[0] > real(0.0):
                v = pull_row(end.mass_matrix, arms[d], v, impulse, contact, arms)
    if wp.static(MAY_HOLD):
        for d in range(ROWS):
            rate = excursion_rate(arms, d, v)
            allowed = speed_range(here, d, contact.row_side[d])
            speed = real(wp.clamp(rate, allowed[0], allowed[1]))
            slides = contact.row_held[d] == real(0.0) and row_counts(contact, d)
            if speed != rate and slides:
                v = bring_row(end.mass_matrix, arms[d], v, speed, contact, arms)
    # A new struct: an adjoint reads a call's arguments again, so they must not change after it.
    out = end
    out.divided = real(1.0)
    out.v = v
    out.q = within_stops(mechanism, here.world, contact, end.q)
    return out


@device_template
def within_stops(
    mechanism: Mechanism, world: int, contact: ContactStates, q: JointVector
) -> JointVector:
    """Return joint positions with those at the edge of their stops that met them unresisted."""
    out = q
    for j in range(JOINTS):
        if contact.touch[j] == real(0.0):
            upper = mechanism.upper[world][j] + real(EDGE)
            lower = mechanism.lower[world][j] - real(EDGE)
            out[j] = wp.clamp(q[j], lower, upper)
    return out
