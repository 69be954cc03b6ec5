"""One step of mechanism and tendons: second order between events, L-stable, with real sticking.

Scheme: ROS2 with gamma = 1 - 1/sqrt(2), of order two for any approximation of the Jacobian,
L-stable with the exact one. Source: Verwer, Spee, Blom, Hundsdorfer, A second-order Rosenbrock
method applied to photochemical dispersion problems, SIAM J. Sci. Comput. 20 (1999).

Inside a step the *modes* are frozen: each dry friction slides one way or sticks, each stop is in
touch or not, each string pulls or is slack. So the equations are smooth and the order holds. A step
that would cross an event is divided there: up to the event, then the rest in the new mode. Internal
states of effects are answers to the motion over the step; the second stage sees them at its end.

Where a routed tendon is held, its arms turn while the joints move: the stages hold its acceleration
at A q_ddot = -v^T H v, which keeps the order, and at the end of a step its speed is brought back
to what it was, by what the order leaves.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    JointVector,
    ParameterVector,
    Placeholder,
    RowVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.events import (
    after_slack,
    after_touch,
    bring_back,
    bring_event_row,
    catch_spools,
    first_event,
    kept_speeds,
    without_lead,
)
from tendon_newton.simulation.dynamics.forces import smooth_forces
from tendon_newton.simulation.dynamics.memory import renewed
from tendon_newton.simulation.dynamics.modes import choose_modes, constrained_solve
from tendon_newton.simulation.tendons.routes import located, row_arms
from tendon_newton.simulation.tendons.world_drive import at_end, at_start, in_same_mode

Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Motion = Placeholder
ROUTED = False
"""Whether any tendon's moment arms follow from its path."""
HOLDS_ROUTED = False
"""Whether one such may be held at a speed."""

GAMMA = 1.0 - 0.5**0.5


@device_template
def rosenbrock(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
    h: real,
) -> Motion:
    """Advance by h [s] in frozen modes with the two stages of ROS2."""
    g = real(GAMMA) * h
    arms = row_arms(mechanism, world, drive, modes)
    bow = RowVector()
    f = smooth_forces(mechanism, world, p, drive, modes, q, v)
    if wp.static(ROUTED):
        arms = f.arms
        bow = f.bow
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    k1 = constrained_solve(matrix, f.torque + g * (f.stiffness * v), modes, arms, bow)
    slope = v + g * k1
    q1 = q + h * slope
    v1 = v + h * k1
    line = f.line
    later = in_same_mode(at_end(drive, h, k1), f.slack)
    f = smooth_forces(mechanism, world, p, later, modes, q1, v1)
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    rest = v1 - real(2.0) * slope
    load = f.torque - real(2.0) * (f.mass_matrix * k1) + g * (f.stiffness * rest)
    speed = RowVector()
    if wp.static(HOLDS_ROUTED):
        speed = arms * v
        arms = f.arms
        bow = f.bow + real(2.0) * (arms * k1)
    k2 = constrained_solve(matrix, load, modes, arms, bow)
    out = Motion()
    out.q = q + h * (real(1.5) * slope + real(0.5) * (rest + g * k2))
    out.v = v + h * (real(1.5) * k1 + real(0.5) * k2)
    out.mass_matrix = f.mass_matrix
    out.line = line
    if wp.static(HOLDS_ROUTED):
        out = kept_speeds(mechanism, world, drive, modes, speed, out)
    return out


@device_template
def step(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    q: JointVector,
    v: JointVector,
    h: real,
) -> Motion:
    """Advance positions, velocities and memory (`drive.memory`) by h [s]; divide at an event."""
    start = located(mechanism, world, at_start(drive, drive.time, drive.memory), q, v)
    modes = choose_modes(mechanism, world, p, start, q, v)
    begun = modes
    end = rosenbrock(mechanism, world, p, start, modes, q, v, h)
    event = first_event(mechanism, world, p, start, modes, q, v, end, h)
    if event.fraction < real(1.0):
        part = event.fraction * h
        middle = rosenbrock(mechanism, world, p, start, modes, q, v, part)
        memory = renewed(mechanism, world, p, start, modes, v, middle, part)
        v = bring_event_row(mechanism, world, start, event, modes, middle)
        x = without_lead(event, middle.q)
        start = after_slack(at_start(drive, drive.time + part, memory), event)
        start = located(mechanism, world, start, x, v)
        chosen = choose_modes(mechanism, world, p, start, x, v)
        modes = after_touch(chosen, event)
        h = h - part
        end = rosenbrock(mechanism, world, p, start, modes, x, v, h)
        end = bring_back(mechanism, world, p, start, modes, v, end, h)
    end = catch_spools(mechanism, world, start, modes, end)
    end.memory = renewed(mechanism, world, p, start, modes, v, end, h)
    end.modes = begun
    return end


@device_template
def whole_step(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
    h: real,
) -> Motion:
    """Do what `step` does where no event divides it, in the modes that it has chosen."""
    start = located(mechanism, world, at_start(drive, drive.time, drive.memory), q, v)
    end = rosenbrock(mechanism, world, p, start, modes, q, v, h)
    end.memory = renewed(mechanism, world, p, start, modes, v, end, h)
    return end
