"""What ends a step's modes: a row at a speed at which it may be held, an end stop met or left."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    TENDONS,
    ArmMatrix,
    JointMatrix,
    JointVector,
    Placeholder,
    TendonVector,
    Vec2,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.forces import touching
from tendon_newton.simulation.modes import constrained_solve
from tendon_newton.simulation.pipeline import excursion
from tendon_newton.simulation.routes import located, tendon_arms
from tendon_newton.simulation.world_drive import UNBOUNDED

Drive = Placeholder
Event = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Motion = Placeholder
MAY_HOLD = False
HOLDS_ROUTED = False
"""Whether a tendon whose arms follow from its path may be held at a speed."""

EDGE = 1.0e-6
"""How far beyond its bound a joint counts as at the edge of its stop, and in touch [rad, m]."""
NOTHING = -1
"""Row of an event that brings no row to a speed."""


@device_template
def speed_range(drive: Drive, d: int, side: real) -> Vec2:
    """Return the least and the greatest rate [m/s] of a tendon that slides on a side."""
    bound = drive.greatest_speed[d]
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
def crossing(before: real, after: real) -> real:
    """Return the fraction of a step at which a quantity is zero; 0 if its sign never changed."""
    fraction = real(0.0)
    if before * after < real(0.0):
        fraction = before / (before - after)
    return fraction


@device_template
def motion_arms(mechanism: Mechanism, world: int, motion: Motion) -> ArmMatrix:
    """Return the moment arms at the end of a motion [m], shape (D, J)."""
    arms = mechanism.arms[world]
    if wp.static(HOLDS_ROUTED):
        arms = motion.arms
    return arms


@device_template
def kept_speeds(
    mechanism: Mechanism, world: int, drive: Drive, modes: Modes, speed: TendonVector, end: Motion
) -> Motion:
    """Return the end of a step with its arms, and the held tendons at their speeds [m/s] again."""
    there = located(mechanism, world, drive, end.q, end.v)
    v = end.v
    for d in range(TENDONS):
        if modes.tendon_sticks[d] > real(0.0):
            freed = modes
            freed.tendon_sticks[d] = real(0.0)
            v = bring_row(end.mass_matrix, there.arms[d], v, speed[d], freed, there.arms)
    out = end
    out.v = v
    out.arms = there.arms
    return out


@device_template
def first_event(
    mechanism: Mechanism, world: int, drive: Drive, modes: Modes,
    q: JointVector, v: JointVector, end: Motion,
) -> Event:  # fmt: skip
    """Find what ends the modes first inside a step; the drive was located at q and v."""
    event = Event()
    event.fraction = real(1.0)
    event.row = int(NOTHING)
    event.joint = int(NOTHING)
    touch = touching(mechanism, world, end.q, end.v)
    for j in range(JOINTS):
        if drive.friction[j] > real(0.0) and end.v[j] * modes.joint[j] < real(0.0):
            fraction = crossing(v[j], end.v[j])
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = j
        if touch[j] != modes.touch[j]:
            fraction = stop_crossing(mechanism, world, j, modes.touch[j] + touch[j], q, v, end)
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = int(NOTHING)
                event.joint = j
                event.touch = touch[j]
    if wp.static(MAY_HOLD):
        arms = tendon_arms(mechanism, world, drive)
        later = motion_arms(mechanism, world, end)
        for d in range(TENDONS):
            after = excursion(later, d, end.v)
            allowed = speed_range(drive, d, modes.tendon[d])
            speed = wp.clamp(after, allowed[0], allowed[1])
            if speed != after and modes.tendon_sticks[d] == real(0.0):
                fraction = crossing(excursion(arms, d, v) - speed, after - speed)
                if fraction < event.fraction:
                    event.fraction = fraction
                    event.row = JOINTS + d
                    event.speed = speed
    return event


@device_template
def stop_crossing(
    mechanism: Mechanism,
    world: int,
    j: int,
    side: real,
    q: JointVector,
    v: JointVector,
    end: Motion,
) -> real:
    """Return the fraction of a step at which joint j meets or leaves a stop (side > 0: upper)."""
    k = mechanism.limit_stiffness[world][j]
    c = mechanism.limit_damping[world][j]
    bound = mechanism.lower[world][j]
    if side > real(0.0):
        bound = mechanism.upper[world][j]
    before = q[j] - bound
    after = end.q[j] - bound
    if before * side > real(0.0) or after * side <= real(0.0):
        before = k * before + c * v[j]  # in touch already, or leaving: the stop's force decides
        after = k * after + c * end.v[j]
    fraction = real(1.0)
    if before * after < real(0.0):
        fraction = crossing(before, after)
    return fraction


@device_template
def after_touch(modes: Modes, event: Event) -> Modes:
    """Return modes in which the joint of an event has met or left its end stop."""
    out = modes
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
    modes: Modes,
    arms: ArmMatrix,
) -> JointVector:
    """Bring the speed along a row to a value [m/s, rad/s] by an impulse; what is held stays so."""
    response = constrained_solve(matrix, row, modes, arms, TendonVector())
    admittance = wp.dot(row, response)
    out = v
    if admittance > real(0.0):
        out = v + response * ((speed - wp.dot(row, v)) / admittance)
    return out


@device_template
def bring_event_row(
    mechanism: Mechanism, world: int, event: Event, modes: Modes, middle: Motion
) -> JointVector:
    """Bring the row that an event names to its speed exactly: the next modes see it there."""
    v = middle.v
    arms = motion_arms(mechanism, world, middle)
    for j in range(JOINTS):
        if event.row == j:
            v = bring_row(middle.mass_matrix, joint_row(j), v, event.speed, modes, arms)
    for d in range(TENDONS):
        if event.row == JOINTS + d:
            v = bring_row(middle.mass_matrix, arms[d], v, event.speed, modes, arms)
    return v


@device_template
def joint_row(j: int) -> JointVector:
    """Return the row of joint j."""
    row = JointVector()
    row[j] = real(1.0)
    return row


@device_template
def holding_joint(modes: Modes, j: int) -> Modes:
    """Return modes in which joint j is held too."""
    out = modes
    out.joint_sticks[j] = real(1.0)
    return out


@device_template
def bring_back(mechanism: Mechanism, world: int, drive: Drive, modes: Modes, end: Motion) -> Motion:
    """Return the end of a divided step with those rows brought back that left their mode's range.

    They are second events inside one step. A joint that has run through an end stop is put at its
    edge: the way beyond, which nothing resisted, would come back as energy.
    """
    v = end.v
    arms = motion_arms(mechanism, world, end)
    for j in range(JOINTS):
        if drive.friction[j] > real(0.0) and v[j] * modes.joint[j] < real(0.0):
            v = bring_row(end.mass_matrix, joint_row(j), v, real(0.0), modes, arms)
            modes = holding_joint(modes, j)
    if wp.static(MAY_HOLD):
        for d in range(TENDONS):
            rate = excursion(arms, d, v)
            allowed = speed_range(drive, d, modes.tendon[d])
            speed = real(wp.clamp(rate, allowed[0], allowed[1]))
            if speed != rate and modes.tendon_sticks[d] == real(0.0):
                v = bring_row(end.mass_matrix, arms[d], v, speed, modes, arms)
    # A new struct: an adjoint reads a call's arguments again, so they must not change after it.
    out = end
    out.divided = real(1.0)
    out.v = v
    out.q = within_stops(mechanism, world, modes, end.q)
    return out


@device_template
def within_stops(mechanism: Mechanism, world: int, modes: Modes, q: JointVector) -> JointVector:
    """Return joint positions with those at the edge of their stops that met them unresisted."""
    out = q
    for j in range(JOINTS):
        if modes.touch[j] == real(0.0):
            upper = mechanism.upper[world][j] + real(EDGE)
            lower = mechanism.lower[world][j] - real(EDGE)
            out[j] = wp.clamp(q[j], lower, upper)
    return out
