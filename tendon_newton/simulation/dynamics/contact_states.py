"""Contact states of a step: what slides which way, what sticks, which end stops are in touch.

A *row* is a direction in which speed can be held: a joint, or a tendon's excursion. A tendon's row
is held at rest by dry friction, or at the motor's greatest speed. The row's *sides* are what it
does just above and just below that speed: +1 slides in, -1 slides out, +2 and -2 are beyond the
greatest. A row slides beyond it only where the motor cannot hold it back: a loose string that its
mechanism takes in. Otherwise an impulse brings it to the greatest speed, and there it is held.
Where a spool moves on its own, its gear has one row and the string in its guides another.
"""

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse, solution
from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_BODY,
    HAS_ROTOR,
    JOINTS,
    LINKS,
    MAY_HOLD,
    REST,
    ROUTED,
    ROWS,
    TENDONS,
    JointMatrix,
    JointVector,
    ParameterVector,
    RowMatrix,
    RowVector,
    Vec2,
    real,
)
from tendon_newton.device_code.structs import Beginning, ContactStates, Drive, Forces, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import UNBOUNDED
from tendon_newton.simulation.dynamics.forces import free_part, smooth_forces, touching
from tendon_newton.simulation.tendons.routes import row_arms, row_bow
from tendon_newton.simulation.tendons.spools import is_string, spool_at, taut_spools
from tendon_newton.simulation.tendons.states import flow_at
from tendon_newton.simulation.tendons.tension import tension_now

AT_LIMIT = 1.0e-6  # Share of the greatest speed within which the motor may be held at it [1]
# Share of the greatest speed above which the motor is faster than it can be [1]
BEYOND = 1.0 + AT_LIMIT
SWEEPS = 12  # Gauss-Seidel sweeps over the rows that may be held; one row alone needs one


@device_template
def sign(x: real) -> real:
    """Return +1 for x >= 0, else -1."""
    out = real(1.0)
    if x < real(0.0):
        out = real(-1.0)
    return out


@device_template
def excursion_rate(rows: RowMatrix, r: int, v: JointVector) -> real:
    """Return the speed along a row [m/s]."""
    rate = real(0.0)
    for j in range(JOINTS):
        rate = rate + rows[r, j] * v[j]
    return rate


@device_template
def row_tendon(r: int) -> int:
    """Return the tendon of a row."""
    d = int(r)
    if r >= TENDONS:
        d = r - TENDONS
    return d


@device_template
def row_bound(drive: Drive, r: int) -> real:
    """Return the greatest speed [m/s] along a row: a motor's; a guide knows none."""
    bound = real(UNBOUNDED)
    if r < TENDONS:
        bound = drive.greatest_speed[r]
    return bound


@device_template
def row_forces(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    d: int,
    side: real,
    guide_side: real,
) -> Vec2:
    """Return the forces [N] along tendon d's rows on a side each: its gear's and its string's.

    A string whose spool is held has its gear's row alone.
    """
    forces = Vec2()
    if wp.static(FREE_SPOOL):
        if contact.joint_held[LINKS + d] == real(0.0):
            spool = spool_at(mechanism, p, here, d, side, guide_side)
            forces = Vec2(spool.force[0], spool.pull[0])
        else:
            held = flow_at(mechanism, p, here, d, side)
            forces = Vec2(held.pull[0], real(0.0))
    else:
        flow = flow_at(mechanism, p, here, d, side)
        forces = Vec2(flow.pull[0], real(0.0))
    return forces


@device_template
def row_counts(contact: ContactStates, r: int) -> bool:
    """Tell whether a row is one of its own: a string whose spool is held has its gear's."""
    counts = bool(True)
    if wp.static(FREE_SPOOL):
        if r >= TENDONS:
            counts = contact.joint_held[LINKS + row_tendon(r)] == real(0.0)
    return counts


@device_template
def may_outrun(mechanism: Mechanism, here: Drive, d: int, side: real) -> bool:
    """Tell whether a row may be faster than its motor: a string that goes slack as it winds in."""
    outruns = bool(False)
    if wp.static(not HAS_ROTOR):
        outruns = side > real(0.0) and is_string(mechanism, here.world, row_tendon(d))
    return outruns


@device_template
def tendon_sides(
    mechanism: Mechanism, here: Drive, contact: ContactStates, d: int, rate: real
) -> ContactStates:
    """Write the side of a tendon at a rate [m/s], or both sides of a speed where it may be held."""
    side = sign(rate)
    bound = row_bound(here, d)
    speed = wp.abs(rate)
    beyond = speed > bound * real(BEYOND)
    contact.row_side[d] = side
    if beyond and may_outrun(mechanism, here, d, side):
        contact.row_side[d] = real(2.0) * side
        beyond = False
    if here.dry > real(0.0) and speed <= real(REST):
        contact.row_held[d] = real(1.0)
        contact.least_side[d] = real(1.0)
        contact.most_side[d] = real(-1.0)
    if beyond or wp.abs(speed - bound) <= real(AT_LIMIT) * bound:
        contact.row_held[d] = real(1.0)
        contact.least_side[d] = real(2.0)
        contact.most_side[d] = real(1.0)
        if side < real(0.0):
            contact.least_side[d] = real(-1.0)
            contact.most_side[d] = real(-2.0)
    return contact


@device_template
def choose_contact_states(mechanism: Mechanism, p: ParameterVector, here: Drive) -> ContactStates:
    """Decide which strings are taut, and which rows are held.

    Those are held whose holding force stays within its limits.
    """
    begun = begin(mechanism, p, here)
    return begun.contact


@device_template
def begin(mechanism: Mechanism, p: ParameterVector, here: Drive) -> Beginning:
    """Return the contact states, and the forces in them, which say whether strings pull.

    Where a string that was taken for taut does not pull, all is decided again without it.
    """
    contact = ContactStates()
    forces = Forces()
    if wp.static(FREE_SPOOL):
        contact.joint_held = taut_spools(mechanism, here)
    again = bool(True)
    while again:
        again = bool(False)
        chosen = choose_held(mechanism, p, here, contact)
        if chosen.known == real(0.0):
            chosen.forces = smooth_forces(mechanism, p, here, chosen.contact)
        contact = chosen.contact
        forces = chosen.forces
        if wp.static(FREE_SPOOL):
            taut = pulling_spools(mechanism, p, here, contact, forces)
            for d in range(TENDONS):
                again = again or taut[LINKS + d] != contact.joint_held[LINKS + d]
            if again:
                contact = ContactStates()
                contact.joint_held = taut
    out = Beginning()
    out.contact = contact
    out.forces = forces
    return out


@device_template
def pulling_spools(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates, forces: Forces
) -> JointVector:
    """Mark those of the held spools whose strings pull; the others go slack. Shape (J,)."""
    taut = JointVector()
    rows = row_arms(mechanism, here, contact)
    acceleration = constrained_solve(
        forces.mass_matrix, forces.torque, contact, rows, row_bow(here)
    )
    for d in range(TENDONS):
        c = LINKS + d
        if contact.joint_held[c] > real(0.0):
            tension = tension_now(mechanism, p, here, contact, d, forces, acceleration)
            if tension >= real(0.0) or not is_string(mechanism, here.world, d):
                taut[c] = real(1.0)
    return taut


@device_template
def choose_held(
    mechanism: Mechanism, p: ParameterVector, here: Drive, begun: ContactStates
) -> Beginning:
    """Decide which rows are held, where it is known which spools are."""
    contact = begun
    arms = row_arms(mechanism, here, contact)
    contact.touch = touching(mechanism, here.world, here.q, here.v)
    held = int(0)
    sides = int(2)  # not a constant, so that the loop stays one and compiles faster
    least = RowVector()
    most = RowVector()
    for j in range(LINKS):
        contact.joint_direction[j] = sign(here.v[j])
        if wp.abs(here.v[j]) <= real(REST) and here.friction[j] > real(0.0):
            contact.joint_direction[j] = real(0.0)
            contact.joint_held[j] = real(1.0)
            held = held + 1
    for r in range(ROWS):
        rate = excursion_rate(arms, r, here.v)
        contact.row_side[r] = sign(rate)
        if wp.static(MAY_HOLD):
            if row_counts(contact, r):
                contact = tendon_sides(mechanism, here, contact, r, rate)
    if wp.static(MAY_HOLD):
        for d in range(TENDONS):
            g = wp.static(ROWS - TENDONS) + d  # the string's row; the gear's where it has none
            if contact.row_held[d] > real(0.0) or contact.row_held[g] > real(0.0):
                for k in range(sides):
                    side = contact.least_side[d]
                    guide_side = contact.least_side[g]
                    if k > 0:
                        side = contact.most_side[d]
                        guide_side = contact.most_side[g]
                    found = row_forces(mechanism, p, here, contact, d, side, guide_side)
                    if k > 0:
                        most[g] = found[1]
                        most[d] = found[0]
                    else:
                        least[g] = found[1]
                        least[d] = found[0]
        for r in range(ROWS):
            if contact.row_held[r] > real(0.0):
                contact.hold[r] = wp.clamp(real(0.0), least[r], most[r])
                held = held + 1
    out = Beginning()
    out.contact = contact
    if held > 0:
        let_go = release(mechanism, p, here, contact, least, most, held)
        out.contact = let_go.contact
        out.forces = let_go.forces
        out.known = let_go.known
    return out


@device_template
def release(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    least: RowVector,
    most: RowVector,
    held: int,
) -> Beginning:
    """Let those rows go that cannot be held; write the pull [N] of the tendons that are.

    The holding forces solve the complementarity problem of the accelerations by projected
    Gauss-Seidel. Where no row goes, other forces than those that hold stay what they are.
    """
    forces = smooth_forces(mechanism, p, here, contact)
    mobility = inverse(forces.mass_matrix)
    arms = row_arms(mechanism, here, contact)
    bow = row_bow(here)
    limit = here.friction
    hold = JointVector()
    push = forces.torque
    for d in range(ROWS):
        if contact.row_held[d] > real(0.0):
            for j in range(JOINTS):
                push[j] = push[j] + arms[d, j] * contact.hold[d]
    acceleration = mobility * push
    sweeps = int(SWEEPS)
    if held == 1:
        sweeps = 1
    changed = bool(True)
    for _sweep in range(sweeps):
        if wp.static(ROWS > 1):  # with one row a GPU takes a sixth longer over a step that may end
            if not changed:
                break
        changed = bool(False)
        for j in range(LINKS):
            if contact.joint_held[j] > real(0.0):
                force = wp.clamp(hold[j] - acceleration[j] / mobility[j, j], -limit[j], limit[j])
                change = force - hold[j]
                for i in range(JOINTS):
                    acceleration[i] = acceleration[i] + mobility[i, j] * change
                hold[j] = force
                changed = changed or change != real(0.0)
        for d in range(ROWS):
            if contact.row_held[d] > real(0.0):
                response = mobility * arms[d]
                gain = wp.dot(arms[d], acceleration) + bow[d]
                force = wp.clamp(
                    contact.hold[d] - gain / wp.dot(arms[d], response), least[d], most[d]
                )
                change = force - contact.hold[d]
                acceleration = acceleration + response * change
                contact.hold[d] = force
                changed = changed or change != real(0.0)
    known = real(wp.static(0.0 if ROUTED else 1.0))  # a routed tendon is as stiff as it pulls
    for j in range(LINKS):
        if contact.joint_held[j] > real(0.0) and wp.abs(hold[j]) >= limit[j]:
            known = real(0.0)
            contact.joint_direction[j] = sign(acceleration[j])
            contact.joint_held[j] = real(0.0)
    for d in range(ROWS):
        if contact.row_held[d] > real(0.0):
            if contact.hold[d] >= most[d] or contact.hold[d] <= least[d]:
                # which of its limits gave way says where it goes; where both are one, its motion
                contact.row_side[d] = contact.least_side[d]
                slows = wp.dot(arms[d], acceleration) + bow[d] < real(0.0)
                if contact.hold[d] > least[d] or (most[d] <= least[d] and slows):
                    contact.row_side[d] = contact.most_side[d]
                contact.row_held[d] = real(0.0)
                known = real(0.0)
    out = Beginning()
    out.contact = contact
    out.forces = forces
    out.known = known
    return out


@device_template
def constrained_solve(
    matrix: JointMatrix, load: JointVector, contact: ContactStates, arms: RowMatrix, bow: RowVector
) -> JointVector:
    """Solve matrix x = load with x = 0 along every joint that is held, -bow along every tendon."""
    part = free_part(matrix, load, arms, contact)
    if wp.static(HAS_BODY and not MAY_HOLD):  # many coordinates, and no row asks for the inverse
        return solution(part.matrix, part.load)
    else:
        free = part.arms
        mobility = inverse(part.matrix)
        x = mobility * part.load
        if wp.static(MAY_HOLD):
            for _sweep in range(wp.static(1 if ROWS == 1 else SWEEPS)):
                for d in range(ROWS):
                    if contact.row_held[d] > real(0.0):
                        response = mobility * free[d]
                        admittance = wp.dot(free[d], response)
                        if admittance > real(0.0):
                            x = x - response * ((wp.dot(free[d], x) + bow[d]) / admittance)
        return x
