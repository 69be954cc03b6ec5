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
    HOLDS_ROUTED,
    ROUTED,
    ParameterVector,
    RowVector,
    real,
)
from tendon_newton.device_code.structs import Drive, Mechanism, Modes, Motion
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

GAMMA = 1.0 - 0.5**0.5


@device_template
def rosenbrock(
    mechanism: Mechanism, p: ParameterVector, here: Drive, modes: Modes, h: real
) -> Motion:
    """Advance by h [s] in frozen modes with the two stages of ROS2."""
    g = real(GAMMA) * h
    arms = row_arms(mechanism, here, modes)
    bow = RowVector()
    f = smooth_forces(mechanism, p, here, modes)
    if wp.static(ROUTED):
        arms = f.arms
        bow = f.bow
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    k1 = constrained_solve(matrix, f.torque + g * (f.stiffness * here.v), modes, arms, bow)
    slope = here.v + g * k1
    q1 = here.q + h * slope
    v1 = here.v + h * k1
    line = f.line
    later = located(mechanism, in_same_mode(at_end(here, h, k1), f.slack), q1, v1)
    f = smooth_forces(mechanism, p, later, modes)
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    rest = v1 - real(2.0) * slope
    load = f.torque - real(2.0) * (f.mass_matrix * k1) + g * (f.stiffness * rest)
    speed = RowVector()
    if wp.static(HOLDS_ROUTED):
        speed = arms * here.v
        arms = f.arms
        bow = f.bow + real(2.0) * (arms * k1)
    k2 = constrained_solve(matrix, load, modes, arms, bow)
    out = Motion()
    out.q = here.q + h * (real(1.5) * slope + real(0.5) * (rest + g * k2))
    out.v = here.v + h * (real(1.5) * k1 + real(0.5) * k2)
    out.mass_matrix = f.mass_matrix
    out.line = line
    if wp.static(HOLDS_ROUTED):
        out = kept_speeds(mechanism, here, modes, speed, out)
    return out


@device_template
def step(mechanism: Mechanism, p: ParameterVector, drive: Drive, h: real) -> Motion:
    """Advance a world and its memory by h [s] from where the drive has it; divide at an event."""
    start = located(mechanism, at_start(drive, drive.time, drive.memory), drive.q, drive.v)
    modes = choose_modes(mechanism, p, start)
    begun = modes
    end = rosenbrock(mechanism, p, start, modes, h)
    event = first_event(mechanism, p, start, modes, end, h)
    if event.fraction < real(1.0):
        part = event.fraction * h
        middle = rosenbrock(mechanism, p, start, modes, part)
        memory = renewed(mechanism, p, start, modes, middle, part)
        v = bring_event_row(mechanism, start, event, modes, middle)
        q = without_lead(event, middle.q)
        start = after_slack(at_start(drive, drive.time + part, memory), event)
        start = located(mechanism, start, q, v)
        chosen = choose_modes(mechanism, p, start)
        modes = after_touch(chosen, event)
        h = h - part
        end = rosenbrock(mechanism, p, start, modes, h)
        end = bring_back(mechanism, p, start, modes, end, h)
    end = catch_spools(mechanism, start, modes, end)
    end.memory = renewed(mechanism, p, start, modes, end, h)
    end.modes = begun
    return end


@device_template
def whole_step(
    mechanism: Mechanism, p: ParameterVector, drive: Drive, modes: Modes, h: real
) -> Motion:
    """Do what `step` does where no event divides it, in the modes that it has chosen."""
    start = located(mechanism, at_start(drive, drive.time, drive.memory), drive.q, drive.v)
    end = rosenbrock(mechanism, p, start, modes, h)
    end.memory = renewed(mechanism, p, start, modes, end, h)
    return end
