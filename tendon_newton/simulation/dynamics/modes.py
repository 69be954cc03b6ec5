"""Modes of a step: which frictions slide which way, what sticks, which end stops are in touch.

A *row* is a direction in which speed can be held: a joint, or a tendon's excursion. A tendon's row
is held at rest by dry friction, or at the motor's greatest speed. Its *sides* are what it does just
above and just below that speed: +1 slides in, -1 slides out, +2 and -2 are beyond the greatest. A
row slides beyond it only where the motor cannot hold it back: a loose string that its mechanism
takes in. Otherwise an impulse brings it to the greatest speed, and there it is held.
Where a spool moves on its own, its gear has one row and the string in its guides another.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_ROTOR,
    JOINTS,
    LINKS,
    MAY_HOLD,
    REST,
    ROWS,
    TENDONS,
    JointMatrix,
    JointVector,
    ParameterVector,
    RowMatrix,
    RowVector,
    real,
)
from tendon_newton.device_code.structs import Drive, Mechanism, Modes
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.forces import free_part, smooth_forces, touching
from tendon_newton.simulation.tendons.pipeline import flow_at
from tendon_newton.simulation.tendons.routes import row_arms, row_bow
from tendon_newton.simulation.tendons.spools import (
    is_string,
    spool_at,
    taut_spools,
)
from tendon_newton.simulation.tendons.tension import tension_now
from tendon_newton.simulation.tendons.world_drive import UNBOUNDED

AT_LIMIT = 1.0e-6
"""Share of the greatest speed within which the motor may be held at it [1]."""
BEYOND = 1.0 + AT_LIMIT
"""Share of the greatest speed above which the motor is faster than it can be [1]."""
SWEEPS = 12
"""Gauss-Seidel sweeps over the rows that may be held; one row alone needs one."""


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
def row_force(
    mechanism: Mechanism, p: ParameterVector, here: Drive, modes: Modes, r: int, side: real
) -> real:
    """Return the force [N] along a tendon's row on one side."""
    force = real(0.0)
    if wp.static(FREE_SPOOL):
        d = row_tendon(r)
        if modes.joint_sticks[LINKS + d] == real(0.0):
            spool = spool_at(mechanism, p, here, d, side, side)
            force = spool.pull[0]
            if r < TENDONS:
                force = spool.force[0]
        else:
            held = flow_at(mechanism, p, here, d, side)
            force = held.pull[0]
    else:
        flow = flow_at(mechanism, p, here, r, side)
        force = flow.pull[0]
    return force


@device_template
def row_counts(modes: Modes, r: int) -> bool:
    """Tell whether a row is one of its own: a string whose spool is held has its gear's."""
    counts = bool(True)
    if wp.static(FREE_SPOOL):
        if r >= TENDONS:
            counts = modes.joint_sticks[LINKS + row_tendon(r)] == real(0.0)
    return counts


@device_template
def may_outrun(mechanism: Mechanism, here: Drive, d: int, side: real) -> bool:
    """Tell whether a row may be faster than its motor: a string that goes slack as it winds in."""
    outruns = bool(False)
    if wp.static(not HAS_ROTOR):
        outruns = side > real(0.0) and is_string(mechanism, here.world, row_tendon(d))
    return outruns


@device_template
def tendon_sides(mechanism: Mechanism, here: Drive, modes: Modes, d: int, rate: real) -> Modes:
    """Write the side of a tendon at a rate [m/s], or both sides of a speed where it may be held."""
    side = sign(rate)
    bound = row_bound(here, d)
    speed = wp.abs(rate)
    beyond = speed > bound * real(BEYOND)
    modes.tendon[d] = side
    if beyond and may_outrun(mechanism, here, d, side):
        modes.tendon[d] = real(2.0) * side
        beyond = False
    if here.dry > real(0.0) and speed <= real(REST):
        modes.tendon_sticks[d] = real(1.0)
        modes.least_side[d] = real(1.0)
        modes.most_side[d] = real(-1.0)
    if beyond or wp.abs(speed - bound) <= real(AT_LIMIT) * bound:
        modes.tendon_sticks[d] = real(1.0)
        modes.least_side[d] = real(2.0)
        modes.most_side[d] = real(1.0)
        if side < real(0.0):
            modes.least_side[d] = real(-1.0)
            modes.most_side[d] = real(-2.0)
    return modes


@device_template
def choose_modes(mechanism: Mechanism, p: ParameterVector, here: Drive) -> Modes:
    """Decide which strings are taut, and which rows are held.

    Those are held whose holding force stays within its limits.
    """
    modes = Modes()
    if wp.static(FREE_SPOOL):
        modes.joint_sticks = taut_spools(mechanism, here)
    modes = choose_held(mechanism, p, here, modes)
    if wp.static(FREE_SPOOL):
        taut = pulling_spools(mechanism, p, here, modes)
        lost = bool(False)
        for d in range(TENDONS):
            lost = lost or taut[LINKS + d] != modes.joint_sticks[LINKS + d]
        if lost:
            fresh = Modes()
            fresh.joint_sticks = taut
            modes = choose_held(mechanism, p, here, fresh)
    return modes


@device_template
def pulling_spools(
    mechanism: Mechanism, p: ParameterVector, here: Drive, modes: Modes
) -> JointVector:
    """Mark those of the held spools whose strings pull; the others go slack. Shape (J,)."""
    forces = smooth_forces(mechanism, p, here, modes)
    taut = JointVector()
    rows = row_arms(mechanism, here, modes)
    acceleration = constrained_solve(forces.mass_matrix, forces.torque, modes, rows, row_bow(here))
    for d in range(TENDONS):
        c = LINKS + d
        if modes.joint_sticks[c] > real(0.0):
            tension = tension_now(mechanism, p, here, modes, d, acceleration)
            if tension >= real(0.0) or not is_string(mechanism, here.world, d):
                taut[c] = real(1.0)
    return taut


@device_template
def choose_held(mechanism: Mechanism, p: ParameterVector, here: Drive, begun: Modes) -> Modes:
    """Decide which rows are held, where it is known which spools are."""
    modes = begun
    arms = row_arms(mechanism, here, modes)
    modes.touch = touching(mechanism, here.world, here.q, here.v)
    held = int(0)
    least = RowVector()
    most = RowVector()
    for j in range(LINKS):
        modes.joint[j] = sign(here.v[j])
        if wp.abs(here.v[j]) <= real(REST) and here.friction[j] > real(0.0):
            modes.joint[j] = real(0.0)
            modes.joint_sticks[j] = real(1.0)
            held = held + 1
    for d in range(ROWS):
        rate = excursion_rate(arms, d, here.v)
        modes.tendon[d] = sign(rate)
        if wp.static(MAY_HOLD):
            if row_counts(modes, d):
                modes = tendon_sides(mechanism, here, modes, d, rate)
                if modes.tendon_sticks[d] > real(0.0):
                    side = modes.least_side[d]
                    least[d] = row_force(mechanism, p, here, modes, d, side)
                    side = modes.most_side[d]
                    most[d] = row_force(mechanism, p, here, modes, d, side)
                    modes.hold[d] = wp.clamp(real(0.0), least[d], most[d])
                    held = held + 1
    if held > 0:
        modes = release(mechanism, p, here, modes, least, most, held)
    return modes


@device_template
def release(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    modes: Modes,
    least: RowVector,
    most: RowVector,
    held: int,
) -> Modes:
    """Let those rows go that cannot be held; write the pull [N] of the tendons that are.

    The holding forces solve the complementarity problem of the accelerations by projected
    Gauss-Seidel.
    """
    forces = smooth_forces(mechanism, p, here, modes)
    mobility = inverse(forces.mass_matrix)
    arms = row_arms(mechanism, here, modes)
    bow = row_bow(here)
    limit = here.friction
    hold = JointVector()
    push = forces.torque
    for d in range(ROWS):
        if modes.tendon_sticks[d] > real(0.0):
            for j in range(JOINTS):
                push[j] = push[j] + arms[d, j] * modes.hold[d]
    acceleration = mobility * push
    sweeps = int(SWEEPS)
    if held == 1:
        sweeps = 1
    for _sweep in range(sweeps):
        for j in range(LINKS):
            if modes.joint_sticks[j] > real(0.0):
                force = wp.clamp(hold[j] - acceleration[j] / mobility[j, j], -limit[j], limit[j])
                change = force - hold[j]
                for i in range(JOINTS):
                    acceleration[i] = acceleration[i] + mobility[i, j] * change
                hold[j] = force
        for d in range(ROWS):
            if modes.tendon_sticks[d] > real(0.0):
                response = mobility * arms[d]
                gain = wp.dot(arms[d], acceleration) + bow[d]
                force = wp.clamp(
                    modes.hold[d] - gain / wp.dot(arms[d], response), least[d], most[d]
                )
                acceleration = acceleration + response * (force - modes.hold[d])
                modes.hold[d] = force
    for j in range(LINKS):
        if modes.joint_sticks[j] > real(0.0) and wp.abs(hold[j]) >= limit[j]:
            modes.joint[j] = sign(acceleration[j])
            modes.joint_sticks[j] = real(0.0)
    for d in range(ROWS):
        if modes.tendon_sticks[d] > real(0.0):
            if modes.hold[d] >= most[d] or modes.hold[d] <= least[d]:
                # which of its limits gave way says where it goes; where both are one, its motion
                modes.tendon[d] = modes.least_side[d]
                slows = wp.dot(arms[d], acceleration) + bow[d] < real(0.0)
                if modes.hold[d] > least[d] or (most[d] <= least[d] and slows):
                    modes.tendon[d] = modes.most_side[d]
                modes.tendon_sticks[d] = real(0.0)
    return modes


@device_template
def constrained_solve(
    matrix: JointMatrix, load: JointVector, modes: Modes, arms: RowMatrix, bow: RowVector
) -> JointVector:
    """Solve matrix x = load with x = 0 along every joint that is held, -bow along every tendon."""
    part = free_part(matrix, load, arms, modes)
    free = part.arms
    mobility = inverse(part.matrix)
    x = mobility * part.load
    if wp.static(MAY_HOLD):
        for _sweep in range(wp.static(1 if ROWS == 1 else SWEEPS)):
            for d in range(ROWS):
                if modes.tendon_sticks[d] > real(0.0):
                    response = mobility * free[d]
                    admittance = wp.dot(free[d], response)
                    if admittance > real(0.0):
                        x = x - response * ((wp.dot(free[d], x) + bow[d]) / admittance)
    return x
