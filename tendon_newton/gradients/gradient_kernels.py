"""Kernels at both ends of a rollout that can be walked back: its start and its readings."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.linear_algebra import inverse
from tendon_newton.device_code.placeholders import (
    JOINTS,
    LINKS,
    ROWS,
    TENDONS,
    DeviceArray,
    DeviceGrid,
    JointMatrix,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    RowVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.gradients.substep_kernels import row_drive, with_command
from tendon_newton.simulation.dynamics.forces import smooth_forces
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.modes import SWEEPS, choose_modes, row_force
from tendon_newton.simulation.dynamics.sensors import tensions_in
from tendon_newton.simulation.dynamics.settling import (
    GUIDE_STIFFNESS,
    SETTLED,
    frictionless_forces,
    resting_modes,
)
from tendon_newton.simulation.kernels.rollout_kernels import acting_row
from tendon_newton.simulation.tendons.pipeline import excursion, flow_at
from tendon_newton.simulation.tendons.routes import (
    located,
    route_stiffness,
    row_arms,
    row_bow,
    tendon_arms,
)

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
cell_effects: Any = None
chain_terms: Any = None
contact_terms: Any = None
period_effects: Any = None
radius_effects: Any = None
HAS_MEMORY = False
MAY_HOLD = False
"""Whether anything can make a tendon stick."""
ROUTED = False
"""Whether any tendon's moment arms follow from its path."""
TOUCHES = False
"""Whether links may meet obstacles."""
FREE_SPOOL = False
"""Whether each spool has a coordinate of its own."""

NUDGE = 1.0e-6
"""Half step of a central difference [rad, m]: float64 leaves ten digits."""
START_SWEEPS = 4
"""Newton steps at the start where effects remember; each gains a digit. Else one is exact."""


@device_template
def gravity_slope(mechanism: Mechanism, world: int, drive: Drive, q: JointVector) -> JointMatrix:
    """Return the derivative of gravity's torque by the joints' positions [N m/rad]."""
    slope = JointMatrix()
    still = JointVector()
    for j in range(JOINTS):
        nudge = JointVector()
        nudge[j] = real(NUDGE)
        up = chain_terms(mechanism, world, drive, q + nudge, still)
        down = chain_terms(mechanism, world, drive, q - nudge, still)
        for i in range(JOINTS):
            slope[i, j] = (up.torque[i] - down.torque[i]) / (real(2.0) * real(NUDGE))
    return slope


@device_template
def contact_turning(mechanism: Mechanism, world: int, drive: Drive, q: JointVector) -> JointMatrix:
    """Return how the torque of contacts at rest changes as links turn past them [N m/rad].

    The stiffness that they give themselves is that of an unmoved normal.
    """
    still = JointVector()
    here = contact_terms(mechanism, world, drive, q, still)
    slope = -here.stiffness
    count = int(JOINTS)
    for j in range(count):
        nudge = JointVector()
        nudge[j] = real(NUDGE)
        up = contact_terms(mechanism, world, drive, q + nudge, still)
        down = contact_terms(mechanism, world, drive, q - nudge, still)
        for i in range(JOINTS):
            change = (up.torque[i] - down.torque[i]) / (real(2.0) * real(NUDGE))
            slope[i, j] = slope[i, j] + change
    return slope


@device_template
def guide_turning(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    target: TendonVector,
    q: JointVector,
) -> JointMatrix:
    """Return how the torque of a guide at rest changes as the arms turn [N m/rad]."""
    still = JointVector()
    here = located(mechanism, world, drive, q, still)
    pull = TendonVector()
    for d in range(TENDONS):
        flow = flow_at(mechanism, world, p, here, d, q, still, real(0.0))
        stiffness = real(GUIDE_STIFFNESS) * mechanism.spool_radius[world][d]
        pull[d] = stiffness * (target[d] - flow.angle[0])
    return route_stiffness(here, pull)


@device_template
def constant_turning(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    target: TendonVector,
    q: JointVector,
    adj_ret: JointMatrix,
) -> None:
    """Give no derivative: what it multiplies is zero in equilibrium."""


@device_template
def constant_slope(
    mechanism: Mechanism, world: int, drive: Drive, q: JointVector, adj_ret: JointMatrix
) -> None:
    """Give no derivative: what it multiplies is zero in equilibrium."""


@device_template
def with_memory(drive: Drive, memory: MemoryVector) -> Drive:
    """Return a drive with what the effects remember."""
    out = drive
    out.memory = memory
    return out


@device_template
def start_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    settled: DeviceArray[JointVector],
    settled_memory: DeviceArray[MemoryVector],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
) -> None:
    """Polish a settled state by one Newton step.

    Its derivative is that of the equilibrium (implicit function theorem).
    """
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    first = commands.first[i]
    p = parameters[i]
    row = row_drive(mechanism, i, p, commands, first, real(0.0), settled_memory[i])
    drive = with_command(row, commands.angle[first], real(SETTLED))
    guided = commands.starts_measured[i] > 0
    x = settled[i]
    kept = settled_memory[i]
    still = JointVector()
    # Memory and posture depend on each other; each sweep passes the derivative on.
    for _sweep in range(wp.static(START_SWEEPS if HAS_MEMORY else 1)):
        held = with_memory(drive, kept)
        forces = frictionless_forces(mechanism, i, p, held, guided, commands.start_angle[i], x)
        stiffness = forces.stiffness + gravity_slope(mechanism, i, held, x)
        if wp.static(TOUCHES):
            stiffness = stiffness + contact_turning(mechanism, i, held, x)
        if wp.static(ROUTED):  # noqa: SIM102 - known when compiled
            if guided:
                stiffness = stiffness + guide_turning(
                    mechanism, i, p, held, commands.start_angle[i], x
                )
        x = x - inverse(stiffness) * forces.torque
        modes = resting_modes(mechanism, i, p, held, False, x)
        kept = remembered(mechanism, i, p, held, modes, x, still)
    speed = JointVector()
    if guided:
        arms = tendon_arms(mechanism, i, located(mechanism, i, drive, x, still))
        for d in range(TENDONS):
            radius = radius_effects(mechanism.spool_radius[i][d], p)
            rate = commands.start_rate[i][d] * radius
            speed = speed + arms[d] * (rate / wp.dot(arms[d], arms[d]))
    q[0, i] = x
    v[0, i] = speed
    memory[0, i] = kept


@device_template
def holding_forces(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
) -> RowVector:
    """Return the pull [N] of each tendon that sticks: nothing accelerates along what holds.

    The drive was located at q and v.
    """
    forces = smooth_forces(mechanism, world, p, drive, modes, q, v)
    matrix = forces.mass_matrix
    load = forces.torque
    free = row_arms(mechanism, world, drive, modes)
    bow = row_bow(drive)
    for j in range(JOINTS):
        if modes.joint_sticks[j] > real(0.0):
            for i in range(JOINTS):
                matrix[i, j] = real(0.0)
                matrix[j, i] = real(0.0)
            for d in range(ROWS):
                free[d, j] = real(0.0)
            matrix[j, j] = real(1.0)
            load[j] = real(0.0)
    mobility = inverse(matrix)
    hold = RowVector()
    for d in range(ROWS):
        if modes.tendon_sticks[d] > real(0.0):
            # Where the joints hold too, the tendon keeps what `choose_modes` began its search with.
            least = row_force(mechanism, world, p, drive, modes, d, q, v, modes.least_side[d])
            most = row_force(mechanism, world, p, drive, modes, d, q, v, modes.most_side[d])
            hold[d] = wp.clamp(real(0.0), least, most)
            load = load + free[d] * hold[d]
    acceleration = mobility * load
    for _sweep in range(wp.static(1 if ROWS == 1 else SWEEPS)):
        for d in range(ROWS):
            if modes.tendon_sticks[d] > real(0.0):
                response = mobility * free[d]
                admittance = wp.dot(free[d], response)
                if admittance > real(0.0):
                    change = -(wp.dot(free[d], acceleration) + bow[d]) / admittance
                    acceleration = acceleration + response * change
                    hold[d] = hold[d] + change
    return hold


@device_template
def with_hold(modes: Modes, hold: RowVector) -> Modes:
    """Return modes with the pull [N] of the tendons that stick."""
    out = modes
    out.hold = hold
    return out


@device_template
def reading_kernel(
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    rows: DeviceArray[int],
    row_world: DeviceArray[int],
    row_state: DeviceArray[int],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
    joint_position: DeviceArray[JointVector],
    motor_position: DeviceArray[TendonVector],
    motor_velocity: DeviceArray[TendonVector],
    force: DeviceArray[TendonVector],
) -> None:
    """Read encoder and load cell in every row, just after its command took effect."""
    k = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    out = rows[k]
    i = row_world[k]
    at = row_state[k]
    first = commands.first[i]
    p = parameters[i]
    scale = period_effects(real(1.0), p)
    now = commands.time[out] * scale
    acting = acting_row(commands, first, commands.count[i], now, scale, p, out - first)
    row = row_drive(mechanism, i, p, commands, out, now, memory[at, i])
    x = q[at, i]
    xd = v[at, i]
    driven = with_command(row, commands.angle[first + acting], real(0.0))
    drive = located(mechanism, i, driven, x, xd)
    arms = tendon_arms(mechanism, i, drive)
    modes = choose_modes(mechanism, i, p, drive, x, xd)
    if wp.static(MAY_HOLD):
        modes = with_hold(modes, holding_forces(mechanism, i, p, drive, modes, x, xd))
    fresh = drive
    if wp.static(HAS_MEMORY):  # noqa: SIM102 - decided when the kernel is made
        if drive.remembers > real(0.0):
            fresh.memory = remembered(mechanism, i, p, drive, modes, x, xd)
    angle = TendonVector()
    rate = TendonVector()
    tension = TendonVector()
    pulled = tensions_in(mechanism, i, p, drive, modes, x, xd)
    for d in range(TENDONS):
        flow = flow_at(mechanism, i, p, fresh, d, x, xd, modes.tendon[d])
        speed = excursion(arms, d, xd)
        if wp.static(FREE_SPOOL):
            speed = speed + xd[LINKS + d]
        angle[d] = flow.angle[0]
        rate[d] = flow.angle[1] * speed
        tension[d] = cell_effects(pulled[d], now, p)
    joint_position[out] = x
    motor_position[out] = angle
    motor_velocity[out] = rate
    force[out] = tension
