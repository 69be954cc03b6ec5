"""Kernels at both ends of a rollout that can be walked back: its start and its readings."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    FREE_SPOOL,
    HAS_BRISTLES,
    HAS_MEMORY,
    JOINTS,
    LINKS,
    MAY_HOLD,
    ROUTED,
    ROWS,
    TENDONS,
    TOUCHES,
    DeviceArray,
    DeviceGrid,
    JointMatrix,
    JointVector,
    MemoryVector,
    ParameterVector,
    RowVector,
    TendonVector,
    Vec3,
    real,
)
from tendon_newton.device_code.slots import cell_effects, chain_terms, contact_terms
from tendon_newton.device_code.structs import (
    Commands,
    ContactStates,
    Drive,
    Mechanism,
    Query,
    Readout,
    ReadRows,
    StateRows,
    States,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.gradients.substep_kernels import with_command
from tendon_newton.law.spool import SETTLED
from tendon_newton.simulation.dynamics.contact_states import (
    SWEEPS,
    choose_contact_states,
    row_forces,
    row_tendon,
)
from tendon_newton.simulation.dynamics.forces import free_part, smooth_forces
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.sensors import tensions_in
from tendon_newton.simulation.dynamics.settling import (
    GUIDE_STIFFNESS,
    bent_memory,
    frictionless_forces,
    measured_speed,
    resting_contact_states,
    starts_as_measured,
)
from tendon_newton.simulation.kernels.acting_command import in_row, just_after_row, log_of
from tendon_newton.simulation.kernels.history_kernels import all_present, servo_sample, with_held
from tendon_newton.simulation.tendons.routes import (
    located,
    placed,
    route_stiffness,
    row_arms,
    row_bow,
    tendon_arms,
)
from tendon_newton.simulation.tendons.states import excursion, flow_at
from tendon_newton.simulation.tendons.world_drive import world_drive

NUDGE = 1.0e-6  # Half step of a central difference [rad, m]: float64 leaves ten digits
# Newton steps at the start where effects remember; each gains a digit. Else one is exact.
START_SWEEPS = 4


@device_template
def gravity_slope(mechanism: Mechanism, drive: Drive, q: JointVector) -> JointMatrix:
    """Return the derivative of gravity's torque by the joints' positions [N m/rad]."""
    slope = JointMatrix()
    still = JointVector()
    for j in range(JOINTS):
        nudge = JointVector()
        nudge[j] = real(NUDGE)
        up = chain_terms(mechanism, placed(drive, q + nudge, still))
        down = chain_terms(mechanism, placed(drive, q - nudge, still))
        for i in range(JOINTS):
            slope[i, j] = (up.torque[i] - down.torque[i]) / (real(2.0) * real(NUDGE))
    return slope


@device_template
def contact_turning(mechanism: Mechanism, drive: Drive, q: JointVector) -> JointMatrix:
    """Return how the torque of contacts at rest changes as links turn past them [N m/rad].

    The stiffness that they give themselves is that of an unmoved normal.
    """
    still = JointVector()
    here = contact_terms(mechanism, placed(drive, q, still))
    slope = -here.stiffness
    count = int(JOINTS)
    for j in range(count):
        nudge = JointVector()
        nudge[j] = real(NUDGE)
        up = contact_terms(mechanism, placed(drive, q + nudge, still))
        down = contact_terms(mechanism, placed(drive, q - nudge, still))
        for i in range(JOINTS):
            change = (up.torque[i] - down.torque[i]) / (real(2.0) * real(NUDGE))
            slope[i, j] = slope[i, j] + change
    return slope


@device_template
def guide_turning(
    mechanism: Mechanism, p: ParameterVector, drive: Drive, target: TendonVector, q: JointVector
) -> JointMatrix:
    """Return how the torque of a guide at rest changes as the arms turn [N m/rad]."""
    still = JointVector()
    here = located(mechanism, drive, q, still)
    pull = TendonVector()
    for d in range(TENDONS):
        flow = flow_at(mechanism, p, here, d, real(0.0))
        stiffness = real(GUIDE_STIFFNESS) * mechanism.spool_radius[drive.world][d]
        pull[d] = stiffness * (target[d] - flow.angle[0])
    return route_stiffness(here, pull)


@device_template
def constant_turning(
    mechanism: Mechanism,
    p: ParameterVector,
    drive: Drive,
    target: TendonVector,
    q: JointVector,
    adj_ret: JointMatrix,
) -> None:
    """Give no derivative: what it multiplies is zero in equilibrium."""


@device_template
def constant_slope(
    mechanism: Mechanism, drive: Drive, q: JointVector, adj_ret: JointMatrix
) -> None:
    """Give no derivative: what it multiplies is zero in equilibrium."""


@device_template
def at_rest(drive: Drive, memory: MemoryVector) -> Drive:
    """Return a drive whose world has been at rest for good, with what it remembers."""
    out = drive
    out.memory = memory
    out.elapsed = real(SETTLED)
    return out


@device_template
def start_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    settled: States,
    states: StateRows,
) -> None:
    """Polish a settled state by one Newton step.

    Its derivative is that of the equilibrium (implicit function theorem).
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    p = parameters[i]
    log = log_of(commands, i, p)
    kept = settled.memory[i]
    row = in_row(world_drive(mechanism, i, p), commands, log, 0)
    drive = with_command(row, commands.angle[log.first], kept)
    guided = starts_as_measured(commands, i, row)
    x = settled.q[i]
    still = JointVector()
    # Memory and posture depend on each other; each sweep passes the derivative on.
    for _sweep in range(wp.static(START_SWEEPS if HAS_MEMORY else 1)):
        held = at_rest(drive, kept)
        forces = frictionless_forces(mechanism, p, held, guided, commands.start_angle[i], x)
        stiffness = forces.stiffness + gravity_slope(mechanism, held, x)
        if wp.static(TOUCHES):
            stiffness = stiffness + contact_turning(mechanism, held, x)
        if wp.static(ROUTED):
            if guided:
                turning = guide_turning(mechanism, p, held, commands.start_angle[i], x)
                stiffness = stiffness + turning
        x = x - inverse(stiffness) * forces.torque
        if wp.static(HAS_MEMORY):
            here = located(mechanism, held, x, still)
            kept = remembered(mechanism, p, here, resting_contact_states(mechanism, p, here, False))
    speed = JointVector()
    if wp.static(HAS_BRISTLES):
        if row.dry < real(0.0):
            held = at_rest(drive, kept)
            kept = bent_memory(mechanism, p, held, guided, commands.start_angle[i], x)
    if guided:
        end = located(mechanism, drive, x, still)
        speed = measured_speed(mechanism, p, end, commands.start_rate[i])
    states.q[0, i] = x
    states.v[0, i] = speed
    states.memory[0, i] = kept


@device_template
def holding_forces(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates
) -> RowVector:
    """Return the pull [N] of each tendon that sticks: nothing accelerates along what holds."""
    forces = smooth_forces(mechanism, p, here, contact)
    arms = row_arms(mechanism, here, contact)
    part = free_part(forces.mass_matrix, forces.torque, arms, contact)
    load = part.load
    free = part.arms
    bow = row_bow(here)
    mobility = inverse(part.matrix)
    hold = RowVector()
    for d in range(ROWS):
        if contact.row_held[d] > real(0.0):
            # Where the joints hold too, the tendon keeps the start of `choose_contact_states`.
            least = row_force(mechanism, p, here, contact, d, contact.least_side[d])
            most = row_force(mechanism, p, here, contact, d, contact.most_side[d])
            hold[d] = wp.clamp(real(0.0), least, most)
            load = load + free[d] * hold[d]
    acceleration = mobility * load
    for _sweep in range(wp.static(1 if ROWS == 1 else SWEEPS)):
        for d in range(ROWS):
            if contact.row_held[d] > real(0.0):
                response = mobility * free[d]
                admittance = wp.dot(free[d], response)
                if admittance > real(0.0):
                    change = -(wp.dot(free[d], acceleration) + bow[d]) / admittance
                    acceleration = acceleration + response * change
                    hold[d] = hold[d] + change
    return hold


@device_template
def row_force(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    contact: ContactStates,
    r: int,
    side: real,
) -> real:
    """Return the force [N] along a row on one side."""
    forces = row_forces(mechanism, p, here, contact, row_tendon(r), side, side)
    force = forces[0]
    if r >= TENDONS:
        force = forces[1]
    return force


@device_template
def with_hold(contact: ContactStates, hold: RowVector) -> ContactStates:
    """Return contact states with the pull [N] of the tendons that stick."""
    out = contact
    out.hold = hold
    return out


@device_template
def reading_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    rows: ReadRows,
    states: StateRows,
    readout: Readout,
) -> None:
    """Read encoder and load cell in every row, just after its command took effect."""
    k = int(wp.tid())  # pyright: ignore[reportArgumentType]
    out = rows.row[k]
    i = rows.world[k]
    at = rows.state[k]
    p = parameters[i]
    log = log_of(commands, i, p)
    kept = states.memory[at, i]
    driven = just_after_row(mechanism, i, p, commands, log, out - log.first, kept)
    here = located(mechanism, driven, states.q[at, i], states.v[at, i])
    contact = choose_contact_states(mechanism, p, here)
    if wp.static(MAY_HOLD):
        contact = with_hold(contact, holding_forces(mechanism, p, here, contact))
    fresh = here
    if wp.static(HAS_MEMORY):
        if here.remembers > real(0.0):
            fresh.memory = remembered(mechanism, p, here, contact)
    arms = tendon_arms(mechanism, here)
    angle = TendonVector()
    rate = TendonVector()
    tension = TendonVector()
    forces = smooth_forces(mechanism, p, here, contact)
    pulled = tensions_in(mechanism, p, here, contact, forces)
    for d in range(TENDONS):
        flow = flow_at(mechanism, p, fresh, d, contact.row_side[d])
        speed = excursion(arms, d, here.v)
        if wp.static(FREE_SPOOL):
            speed = speed + here.v[LINKS + d]
        angle[d] = flow.angle[0]
        rate[d] = flow.angle[1] * speed
        tension[d] = cell_effects(pulled[d], here.time, d, p)
    readout.joint_position[out] = here.q
    readout.motor_position[out] = angle
    readout.motor_velocity[out] = rate
    readout.force[out] = tension


@device_template
def query_state(
    mechanism: Mechanism,
    p: ParameterVector,
    commands: Commands,
    query: Query,
    states: StateRows,
    i: int,
) -> Drive:
    """Return a world in the row of a query, just after its command took effect."""
    log = log_of(commands, i, p)
    row = query.row[query.index, i]
    drive = just_after_row(mechanism, i, p, commands, log, row, states.memory[query.slot, i])
    return located(mechanism, drive, states.q[query.slot, i], states.v[query.slot, i])


@device_template
def taped_sense_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    query: Query,
    states: StateRows,
    samples: DeviceGrid[Vec3],
) -> None:
    """Write what a network is shown of each world in the row of a query."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    p = parameters[i]
    here = query_state(mechanism, p, commands, query, states, i)
    arms = tendon_arms(mechanism, here)
    contact = choose_contact_states(mechanism, p, here)
    for d in range(TENDONS):
        flow = flow_at(mechanism, p, here, d, contact.row_side[d])
        rate = flow.angle[1] * excursion(arms, d, here.v)
        sample = servo_sample(mechanism, p, here, d, flow.angle[0], rate)
        samples[query.index, i * TENDONS + d] = sample


@device_template
def taped_hold_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    query: Query,
    force: DeviceGrid[TendonVector],
    states: StateRows,
) -> None:
    """Go on from a slot of the states to the next, with the forces [N] of a query held."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    p = parameters[i]
    here = query_state(mechanism, p, commands, query, states, i)
    kept = all_present(mechanism, p, here)
    for d in range(TENDONS):
        kept = with_held(mechanism, i, d, force[query.index, i][d], kept)
    states.q[query.slot + 1, i] = here.q
    states.v[query.slot + 1, i] = here.v
    states.memory[query.slot + 1, i] = kept
