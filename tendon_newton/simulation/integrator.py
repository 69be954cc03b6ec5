"""One step of the mechanism and its tendons: second order between stick and stop events, L-stable, with friction that sticks.

Scheme: ROS2 with gamma = 1 - 1/sqrt(2), of order two for any approximation of the Jacobian, L-stable with the exact one.
Source: Verwer, Spee, Blom, Hundsdorfer, A second-order Rosenbrock method applied to photochemical dispersion problems, SIAM
J. Sci. Comput. 20 (1999).

Inside a step the *modes* are frozen: each dry friction slides one way or sticks, each end stop is in touch or not. So the equations are
smooth and the order holds. A step that would cross an event is divided there: up to the event, then the rest in the new mode.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    TENDONS,
    ArmMatrix,
    Jet,
    JointMatrix,
    JointVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.simulation.pipeline import (
    damping_torque,
    motor_force,
    spring_torque,
    tendon_state,
    tension,
)
from tendon_newton.device_code.templates import device_template

ChainTerms: Any = None
Drive: Any = None
Event: Any = None
DRY_OFFSETS: tuple[int, ...] = ()
"""Where the strengths of the tendons' dry frictions stand among the parameters."""
Forces: Any = None
Joint: Any = None
Mechanism: Any = None
Modes: Any = None
Motion: Any = None
chain_terms: Any = None
armature: Any = None
transmission_effects: Any = None

GAMMA = 1.0 - 0.5**0.5
REST = 1.0e-9
"""Below this speed [m/s, rad/s] a dry friction may stick."""
SWEEPS = 12
"""Gauss-Seidel sweeps over the frictions that may stick; one friction alone needs one."""


@device_template
def excursion(arms: ArmMatrix, d: int, x: JointVector) -> real:
    """Return the sum over joints of moment arm times joint coordinate, for tendon d."""
    total = real(0.0)
    for j in range(JOINTS):
        total = total + arms[d, j] * x[j]
    return total


@device_template
def has_dry_friction(p: ParameterVector) -> bool:
    """Tell whether a dry friction acts on the tendons in this world."""
    strength = real(0.0)
    for i in range(wp.static(len(DRY_OFFSETS))):
        strength = strength + wp.abs(p[wp.static(DRY_OFFSETS[i])])
    return strength > real(0.0)


@device_template
def joint_state(mechanism: Mechanism, world: int, j: int, q: JointVector, v: JointVector) -> Joint:
    """Describe joint j to the effects."""
    joint = Joint()
    joint.position = q[j]
    joint.velocity = v[j]
    joint.stiffness = mechanism.stiffness[world][j]
    joint.rest = mechanism.rest[world][j]
    joint.damping = mechanism.damping[world][j]
    joint.lower = mechanism.lower[world][j]
    joint.upper = mechanism.upper[world][j]
    return joint


@device_template
def pull(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, d: int,
    length: real, rate: real, direction: real,
) -> Jet:  # fmt: skip
    """Return what the mechanism feels of tendon d [N] while it slides in a direction (+1 in, -1 out)."""
    tendon = tendon_state(mechanism, world, drive, d, length, rate)
    tendon.direction = direction
    force = motor_force(mechanism, world, p, drive, d, tendon)
    return transmission_effects(tension(mechanism, world, p, d, force, tendon), tendon, p)


@device_template
def smooth_forces(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, modes: Modes,
    q: JointVector, v: JointVector,
) -> Forces:  # fmt: skip
    """Return mass matrix, torque and its derivatives, with every friction that sticks left out."""
    terms = chain_terms(mechanism, world, q, v)
    mass_matrix = terms.mass_matrix
    torque = terms.torque
    stiffness = JointMatrix()  # d torque / d q
    damping = JointMatrix()  # d torque / d v
    arms = mechanism.arms[world]
    friction = mechanism.friction[world]
    for j in range(JOINTS):
        joint = joint_state(mechanism, world, j, q, v)
        sum = spring_torque(joint, p) + damping_torque(joint, p)
        k = mechanism.limit_stiffness[world][j]
        c = mechanism.limit_damping[world][j]
        if modes.touch[j] > real(0.0):
            sum = sum - Jet(k * (joint.position - joint.upper) + c * joint.velocity, k, c)
        if modes.touch[j] < real(0.0):
            sum = sum - Jet(k * (joint.position - joint.lower) + c * joint.velocity, k, c)
        torque[j] = torque[j] + sum[0] - friction[j] * modes.joint[j]
        stiffness[j, j] = stiffness[j, j] + sum[1]
        damping[j, j] = damping[j, j] + sum[2]
    for d in range(TENDONS):
        if modes.tendon_sticks[d] == real(0.0):
            length = mechanism.excursion_offset[world][d] + excursion(arms, d, q)
            force = pull(
                mechanism, world, p, drive, d, length, excursion(arms, d, v), modes.tendon[d]
            )
            for i in range(JOINTS):
                torque[i] = torque[i] + arms[d, i] * force[0]
                for j in range(JOINTS):
                    product = arms[d, i] * arms[d, j]
                    stiffness[i, j] = stiffness[i, j] + product * force[1]
                    damping[i, j] = damping[i, j] + product * force[2]
        inertia = armature(p) / (
            mechanism.spool_radius[world][d] * mechanism.spool_radius[world][d]
        )
        for i in range(JOINTS):
            for j in range(JOINTS):
                mass_matrix[i, j] = mass_matrix[i, j] + inertia * arms[d, i] * arms[d, j]
    out = Forces()
    out.mass_matrix = mass_matrix
    out.torque = torque
    out.stiffness = stiffness
    out.damping = damping
    return out


@device_template
def touching(mechanism: Mechanism, world: int, q: JointVector, v: JointVector) -> JointVector:
    """Return per joint +1 or -1 where the upper or lower end stop pushes, else 0; a stop never pulls."""
    touch = JointVector()
    for j in range(JOINTS):
        k = mechanism.limit_stiffness[world][j]
        c = mechanism.limit_damping[world][j]
        over = q[j] - mechanism.upper[world][j]
        under = q[j] - mechanism.lower[world][j]
        if over > real(0.0) and k * over + c * v[j] > real(0.0):
            touch[j] = real(1.0)
        if under < real(0.0) and k * under + c * v[j] < real(0.0):
            touch[j] = real(-1.0)
    return touch


@device_template
def sign(x: real) -> real:
    """Return +1 for x >= 0, else -1."""
    out = real(1.0)
    if x < real(0.0):
        out = real(-1.0)
    return out


@device_template
def choose_modes(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, q: JointVector, v: JointVector
) -> Modes:
    """Decide which frictions stick: those at rest whose holding force stays within their limit.

    The holding forces solve the complementarity problem of the accelerations by projected Gauss-Seidel.
    """
    arms = mechanism.arms[world]
    modes = Modes()
    modes.touch = touching(mechanism, world, q, v)
    resting = int(0)
    least = modes.tendon
    most = modes.tendon
    for j in range(JOINTS):
        modes.joint[j] = sign(v[j])
        if wp.abs(v[j]) <= real(REST) and mechanism.friction[world][j] > real(0.0):
            modes.joint[j] = real(0.0)
            modes.joint_sticks[j] = real(1.0)
            resting = resting + 1
    for d in range(TENDONS):
        rate = excursion(arms, d, v)
        modes.tendon[d] = sign(rate)
        if wp.static(len(DRY_OFFSETS) > 0):
            if wp.abs(rate) <= real(REST) and has_dry_friction(p):
                length = mechanism.excursion_offset[world][d] + excursion(arms, d, q)
                inward = pull(mechanism, world, p, drive, d, length, rate, real(1.0))
                outward = pull(mechanism, world, p, drive, d, length, rate, real(-1.0))
                least[d] = inward[0]
                most[d] = outward[0]
                modes.tendon[d] = real(0.0)
                modes.tendon_sticks[d] = real(1.0)
                modes.hold[d] = real(0.5) * (inward[0] + outward[0])
                resting = resting + 1
    if resting > 0:
        modes = release(mechanism, world, p, drive, modes, q, v, least, most, resting)
    return modes


@device_template
def release(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, modes: Modes,
    q: JointVector, v: JointVector, least: TendonVector, most: TendonVector, resting: int,
) -> Modes:  # fmt: skip
    """Let those resting frictions slide that cannot hold; write the pull [N] of the tendons that stick."""
    forces = smooth_forces(mechanism, world, p, drive, modes, q, v)
    mobility = inverse(forces.mass_matrix)
    arms = mechanism.arms[world]
    limit = mechanism.friction[world]
    hold = JointVector()
    push = forces.torque
    for d in range(TENDONS):
        if modes.tendon_sticks[d] > real(0.0):
            for j in range(JOINTS):
                push[j] = push[j] + arms[d, j] * modes.hold[d]
    acceleration = mobility * push
    sweeps = int(SWEEPS)
    if resting == 1:
        sweeps = 1
    for _sweep in range(sweeps):
        for j in range(JOINTS):
            if modes.joint_sticks[j] > real(0.0):
                force = wp.clamp(hold[j] - acceleration[j] / mobility[j, j], -limit[j], limit[j])
                change = force - hold[j]
                for i in range(JOINTS):
                    acceleration[i] = acceleration[i] + mobility[i, j] * change
                hold[j] = force
        for d in range(TENDONS):
            if modes.tendon_sticks[d] > real(0.0):
                response = mobility * arms[d]
                force = wp.clamp(
                    modes.hold[d] - wp.dot(arms[d], acceleration) / wp.dot(arms[d], response),
                    least[d], most[d],
                )  # fmt: skip
                acceleration = acceleration + response * (force - modes.hold[d])
                modes.hold[d] = force
    for j in range(JOINTS):
        if modes.joint_sticks[j] > real(0.0):
            if wp.abs(hold[j]) >= limit[j]:
                modes.joint[j] = sign(acceleration[j])
                modes.joint_sticks[j] = real(0.0)
    for d in range(TENDONS):
        if modes.tendon_sticks[d] > real(0.0):
            if modes.hold[d] >= most[d] or modes.hold[d] <= least[d]:
                modes.tendon[d] = sign(wp.dot(arms[d], acceleration))
                modes.tendon_sticks[d] = real(0.0)
    return modes


@device_template
def constrained_solve(
    matrix: JointMatrix, load: JointVector, modes: Modes, arms: ArmMatrix
) -> JointVector:
    """Solve matrix x = load with x = 0 along every friction that sticks."""
    m = matrix
    b = load
    free = arms
    for j in range(JOINTS):
        if modes.joint_sticks[j] > real(0.0):
            for i in range(JOINTS):
                m[i, j] = real(0.0)
                m[j, i] = real(0.0)
            for d in range(TENDONS):
                free[d, j] = real(0.0)
            m[j, j] = real(1.0)
            b[j] = real(0.0)
    mobility = inverse(m)
    x = mobility * b
    if wp.static(len(DRY_OFFSETS) > 0):
        for _sweep in range(wp.static(1 if TENDONS == 1 else SWEEPS)):
            for d in range(TENDONS):
                if modes.tendon_sticks[d] > real(0.0):
                    response = mobility * free[d]
                    admittance = wp.dot(free[d], response)
                    if admittance > real(0.0):
                        x = x - response * (wp.dot(free[d], x) / admittance)
    return x


@device_template
def rosenbrock(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive, modes: Modes,
    q: JointVector, v: JointVector, h: real,
) -> Motion:  # fmt: skip
    """Advance by h [s] in frozen modes with the two stages of ROS2."""
    g = real(GAMMA) * h
    arms = mechanism.arms[world]
    f = smooth_forces(mechanism, world, p, drive, modes, q, v)
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    k1 = constrained_solve(matrix, f.torque + g * (f.stiffness * v), modes, arms)
    slope = v + g * k1
    q1 = q + h * slope
    v1 = v + h * k1
    later = drive
    later.time = drive.time + h
    f = smooth_forces(mechanism, world, p, later, modes, q1, v1)
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    rest = v1 - real(2.0) * slope
    load = f.torque - real(2.0) * (f.mass_matrix * k1) + g * (f.stiffness * rest)
    k2 = constrained_solve(matrix, load, modes, arms)
    out = Motion()
    out.q = q + h * (real(1.5) * slope + real(0.5) * (rest + g * k2))
    out.v = v + h * (real(1.5) * k1 + real(0.5) * k2)
    out.mass_matrix = f.mass_matrix
    return out


@device_template
def crossing(before: real, after: real) -> real:
    """Return the fraction of a step at which a quantity that changes sign is zero."""
    return before / (before - after)


@device_template
def first_event(
    mechanism: Mechanism, world: int, p: ParameterVector, modes: Modes,
    q: JointVector, v: JointVector, end: Motion,
) -> Event:  # fmt: skip
    """Find what ends the modes first inside a step: a friction that stops or an end stop met or left."""
    event = Event()
    event.fraction = real(1.0)
    event.row = int(-1)
    touch = touching(mechanism, world, end.q, end.v)
    for j in range(JOINTS):
        if mechanism.friction[world][j] > real(0.0) and end.v[j] * modes.joint[j] < real(0.0):
            fraction = crossing(v[j], end.v[j])
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = j
                event.stop = int(0)
        if touch[j] != modes.touch[j]:
            fraction = stop_crossing(mechanism, world, j, modes.touch[j] + touch[j], q, v, end)
            if fraction < event.fraction:
                event.fraction = fraction
                event.row = int(-1)
                event.joint = j
                event.touch = touch[j]
                event.stop = int(1)
    if has_dry_friction(p):
        arms = mechanism.arms[world]
        for d in range(TENDONS):
            after = excursion(arms, d, end.v)
            if after * modes.tendon[d] < real(0.0):
                fraction = crossing(excursion(arms, d, v), after)
                if fraction < event.fraction:
                    event.fraction = fraction
                    event.row = JOINTS + d
                    event.stop = int(0)
    return event


@device_template
def stop_crossing(
    mechanism: Mechanism, world: int, j: int, side: real, q: JointVector, v: JointVector, end: Motion
) -> real:
    """Return the fraction of a step at which joint j meets or leaves its upper (side > 0) or lower end stop."""
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
def stop_row(matrix: JointMatrix, row: JointVector, v: JointVector) -> JointVector:
    """Bring the speed along one friction to rest by an impulse along it."""
    response = inverse(matrix) * row
    return v - response * (wp.dot(row, v) / wp.dot(row, response))


@device_template
def stop_reversals(
    mechanism: Mechanism, world: int, p: ParameterVector, modes: Modes, end: Motion
) -> JointVector:
    """Bring frictions that reversed to rest: a second event inside one step."""
    v = end.v
    for j in range(JOINTS):
        if mechanism.friction[world][j] > real(0.0) and v[j] * modes.joint[j] < real(0.0):
            row = JointVector()
            row[j] = real(1.0)
            v = stop_row(end.mass_matrix, row, v)
    if has_dry_friction(p):
        for d in range(TENDONS):
            if excursion(mechanism.arms[world], d, v) * modes.tendon[d] < real(0.0):
                v = stop_row(end.mass_matrix, mechanism.arms[world][d], v)
    return v


@device_template
def step(
    mechanism: Mechanism, world: int, p: ParameterVector, drive: Drive,
    q: JointVector, v: JointVector, h: real,
) -> Motion:  # fmt: skip
    """Advance joint positions and velocities by h [s], dividing the step at its first event."""
    modes = choose_modes(mechanism, world, p, drive, q, v)
    end = rosenbrock(mechanism, world, p, drive, modes, q, v, h)
    event = first_event(mechanism, world, p, modes, q, v, end)
    if event.fraction < real(1.0):
        middle = rosenbrock(mechanism, world, p, drive, modes, q, v, event.fraction * h)
        if event.row >= 0:
            row = JointVector()
            for j in range(JOINTS):
                if event.row == j:
                    row[j] = real(1.0)
            for d in range(TENDONS):
                if event.row == JOINTS + d:
                    row = mechanism.arms[world][d]
            middle.v = stop_row(middle.mass_matrix, row, middle.v)
        later = drive
        later.time = drive.time + event.fraction * h
        modes = choose_modes(mechanism, world, p, later, middle.q, middle.v)
        for j in range(JOINTS):
            if event.stop == 1 and event.joint == j:
                modes.touch[j] = event.touch
        end = rosenbrock(
            mechanism, world, p, later, modes, middle.q, middle.v, (real(1.0) - event.fraction) * h
        )
        end.v = stop_reversals(mechanism, world, p, modes, end)
    return end
