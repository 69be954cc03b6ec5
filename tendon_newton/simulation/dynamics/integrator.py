"""One step of mechanism and tendons: second order between events, L-stable, with real sticking.

Scheme: ROS2 with gamma = 1 - 1/sqrt(2), of order two for any approximation of the Jacobian,
L-stable with the exact one. Source: Verwer, Spee, Blom, Hundsdorfer, A second-order Rosenbrock
method applied to photochemical dispersion problems, SIAM J. Sci. Comput. 20 (1999).

Inside a step the *contact states* are frozen: each dry friction slides one way or sticks, each stop
is in touch or not, each string pulls or is slack. The equations are then smooth and the order
holds. A step that would cross an event is divided there: up to the event, then the rest in the new
contact state. Internal states of effects are answers to the motion over the step; the second stage
sees them at its end.

Where a routed tendon is held, its arms turn while the joints move: the stages hold its acceleration
at A q_ddot = -v^T H v, which keeps the order, and at the end of a step its speed is brought back
to what it was, by what the order leaves.
"""

import warp as wp

from tendon_newton.device_code.placeholders import (
    HAS_ROTOR,
    HOLDS_ROUTED,
    ROUTED,
    TAPED,
    ParameterVector,
    RowVector,
    real,
)
from tendon_newton.device_code.structs import ContactStates, Drive, Event, Forces, Mechanism, Motion
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.contact_states import (
    begin,
    choose_contact_states,
    constrained_solve,
)
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
from tendon_newton.simulation.dynamics.memory import renewed, renewed_at
from tendon_newton.simulation.tendons.routes import located, row_arms
from tendon_newton.simulation.tendons.world_drive import at_end, at_start, in_same_mode

GAMMA = 1.0 - 0.5**0.5


@device_template
def rosenbrock(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    forces: Forces,
    h: real,
) -> Motion:
    """Advance by h [s] in frozen contact states, by the forces there, with ROS2's two stages."""
    g = real(GAMMA) * h
    arms = row_arms(mechanism, here, contact)
    bow = RowVector()
    if wp.static(ROUTED):
        arms = forces.arms
        bow = forces.bow
    matrix = forces.mass_matrix - g * forces.damping - g * g * forces.stiffness
    k1 = constrained_solve(
        matrix, forces.torque + g * (forces.stiffness * here.v), contact, arms, bow
    )
    slope = here.v + g * k1
    q1 = here.q + h * slope
    v1 = here.v + h * k1
    ending = at_end(here, h, k1)
    ending = in_same_mode(ending, forces.slack)
    later = located(mechanism, ending, q1, v1)
    f = smooth_forces(mechanism, p, later, contact)
    matrix = f.mass_matrix - g * f.damping - g * g * f.stiffness
    rest = v1 - real(2.0) * slope
    load = f.torque - real(2.0) * (f.mass_matrix * k1) + g * (f.stiffness * rest)
    speed = RowVector()
    if wp.static(HOLDS_ROUTED):
        speed = arms * here.v
        arms = f.arms
        bow = f.bow + real(2.0) * (arms * k1)
    k2 = constrained_solve(matrix, load, contact, arms, bow)
    out = Motion()
    out.q = here.q + h * (real(1.5) * slope + real(0.5) * (rest + g * k2))
    out.v = here.v + h * (real(1.5) * k1 + real(0.5) * k2)
    out.mass_matrix = f.mass_matrix
    out.line = forces.line
    if wp.static(HOLDS_ROUTED):
        out = kept_speeds(mechanism, here, contact, speed, out)
    return out


@device_template
def step(mechanism: Mechanism, p: ParameterVector, drive: Drive, h: real) -> Motion:
    """Advance a world and its memory by h [s] from where the drive has it; divide at an event."""
    begun = at_start(drive, drive.time, drive.memory)
    start = located(mechanism, begun, drive.q, drive.v)
    if wp.static(TAPED):  # a tape does not walk back through the choice of contact states
        contact = choose_contact_states(mechanism, p, start)
        forces = smooth_forces(mechanism, p, start, contact)
    else:
        first = begin(mechanism, p, start)
        contact = first.contact
        forces = first.forces
    end = rosenbrock(mechanism, p, start, contact, forces, h)
    there = Drive()
    if wp.static(ROUTED and not HAS_ROTOR):  # a path takes long, and is needed twice at the end
        there = at_end(start, h, (end.v - start.v) / h)
        there = located(mechanism, there, end.q, end.v)
    event = first_event(mechanism, p, start, contact, end, there, h)
    if event.fraction < real(1.0):
        end = divided_step(mechanism, p, start, contact, forces, event, h)
    elif wp.static(ROUTED and not HAS_ROTOR):
        end.memory = renewed_at(mechanism, p, there, contact)
    else:
        end = catch_spools(mechanism, start, contact, end)
        end.memory = renewed(mechanism, p, start, contact, end, h)
    end.contact = contact
    return end


@device_template
def divided_step(
    mechanism: Mechanism,
    p: ParameterVector,
    start: Drive,
    contact: ContactStates,
    forces: Forces,
    event: Event,
    h: real,
) -> Motion:
    """Advance by h [s]: up to an event in the contact states before it, then in those after it."""
    part = event.fraction * h
    middle = rosenbrock(mechanism, p, start, contact, forces, part)
    memory = renewed(mechanism, p, start, contact, middle, part)
    v = bring_event_row(mechanism, start, event, contact, middle)
    q = without_lead(event, middle.q)
    later = at_start(start, start.time + part, memory)
    later = after_slack(later, event)
    later = located(mechanism, later, q, v)
    after = choose_contact_states(mechanism, p, later)
    after = after_touch(after, event)
    rest = h - part
    given = smooth_forces(mechanism, p, later, after)
    end = rosenbrock(mechanism, p, later, after, given, rest)
    end = bring_back(mechanism, p, later, after, end, rest)
    end = catch_spools(mechanism, later, after, end)
    end.memory = renewed(mechanism, p, later, after, end, rest)
    return end


@device_template
def whole_step(
    mechanism: Mechanism, p: ParameterVector, drive: Drive, contact: ContactStates, h: real
) -> Motion:
    """Do what `step` does where no event divides it, in the contact states that it has chosen."""
    begun = at_start(drive, drive.time, drive.memory)
    start = located(mechanism, begun, drive.q, drive.v)
    forces = smooth_forces(mechanism, p, start, contact)
    end = rosenbrock(mechanism, p, start, contact, forces, h)
    end.memory = renewed(mechanism, p, start, contact, end, h)
    return end
