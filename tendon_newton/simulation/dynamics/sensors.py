"""What encoder and load cell report."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.first_order_lag import lagged
from tendon_newton.device_code.placeholders import (
    HAS_MEMORY,
    HAS_ROTOR,
    TENDONS,
    DeviceArray,
    JointVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import (
    cell_clock_effects,
    cell_effects,
    cell_lag_effects,
    encoder_effects,
    motor_current,
)
from tendon_newton.device_code.structs import (
    Cell,
    Commands,
    ContactStates,
    Drive,
    Forces,
    Log,
    Mechanism,
    Reading,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.servo import servo_flow
from tendon_newton.simulation.dynamics.contact_states import begin, constrained_solve
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.tendons.routes import row_arms, row_bow
from tendon_newton.simulation.tendons.states import tendon_state
from tendon_newton.simulation.tendons.tension import tension_now

INSTANT = 1.0e-6  # Instants [s] closer than this are one


@device_template
def tensions_in(
    mechanism: Mechanism, p: ParameterVector, here: Drive, contact: ContactStates, forces: Forces
) -> TendonVector:
    """Return the tensions at the load cells [N] in known contact states; a string never pushes."""
    acceleration = JointVector()
    if wp.static(HAS_ROTOR):
        rows = row_arms(mechanism, here, contact)
        bow = row_bow(here)
        acceleration = constrained_solve(forces.mass_matrix, forces.torque, contact, rows, bow)
    out = TendonVector()
    for d in range(TENDONS):
        tension = tension_now(mechanism, p, here, contact, d, forces, acceleration)
        if wp.static(HAS_ROTOR):
            tension = wp.max(tension, mechanism.least_tension[here.world][d])
        out[d] = tension
    return out


@device_template
def tensions(mechanism: Mechanism, p: ParameterVector, here: Drive) -> TendonVector:
    """Return the tensions at the load cells [N]."""
    now = begin(mechanism, p, here)
    return tensions_in(mechanism, p, here, now.contact, now.forces)


@device_template
def read_sensors(mechanism: Mechanism, p: ParameterVector, here: Drive) -> Reading:
    """Return the encoder's report just after a command took effect, and the true tension then."""
    begun = begin(mechanism, p, here)
    contact = begun.contact
    reading = Reading()
    now = here
    if wp.static(HAS_MEMORY):
        if here.remembers > real(0.0):
            now.memory = remembered(mechanism, p, here, contact)
    reading.force = tensions_in(mechanism, p, here, contact, begun.forces)
    for d in range(TENDONS):
        tendon = tendon_state(mechanism, p, now, d, contact.row_side[d])
        flow = servo_flow(tendon, p)
        reading.current[d] = motor_current(flow.motor_force[0], tendon, p)
        tendon.tension = reading.force[d]
        angle = encoder_effects(flow.angle, tendon, p)
        reading.angle[d] = angle[0]
        reading.angle_rate[d] = angle[1] * tendon.velocity
    return reading


@device_template
def cells_are_slow(p: ParameterVector) -> bool:
    """Tell whether a load cell is late or lags: its readings need the force between rows."""
    slow = bool(False)
    for d in range(TENDONS):
        lags = cell_lag_effects(real(0.0), d, p) > real(0.0)
        if lags or cell_clock_effects(real(0.0), d, p) != real(0.0):
            slow = True
    return slow


@device_template
def first_due(commands: Commands, log: Log, p: ParameterVector, d: int, begin: int) -> int:
    """Return the first row whose reading of cell d belongs to what follows that of `begin`."""
    due = int(0)
    if begin > 0:
        now = commands.time[log.first + begin] * log.scale - real(INSTANT)
        while due < log.count and (
            cell_clock_effects(commands.time[log.first + due] * log.scale, d, p) < now
        ):
            due = due + 1
    return due


@device_template
def report(
    commands: Commands,
    log: Log,
    p: ParameterVector,
    cell: Cell,
    now: real,
    h: real,
    out: int,
    force: DeviceArray[TendonVector],
) -> Cell:
    """Write the readings that belong to a substep of h [s], in which the tension moves evenly."""
    for d in range(TENDONS):
        cell.due[d] = reported(commands, log, p, cell, d, now, h, out, force)
        rate = (cell.after[d] - cell.before[d]) / h
        lag = cell_lag_effects(real(0.0), d, p)
        cell.force[d] = lagged(cell.force[d], cell.after[d], rate, h, lag)
    return cell


@device_template
def reported(
    commands: Commands,
    log: Log,
    p: ParameterVector,
    cell: Cell,
    d: int,
    now: real,
    h: real,
    out: int,
    force: DeviceArray[TendonVector],
) -> int:
    """Write what cell d shows in a substep of h [s]; return its row that is due next."""
    lag = cell_lag_effects(real(0.0), d, p)
    rate = (cell.after[d] - cell.before[d]) / h
    due = int(cell.due[d])
    waiting = bool(True)
    while waiting:
        waiting = False
        if due < log.count:
            row_time = commands.time[log.first + due] * log.scale
            at = cell_clock_effects(row_time, d, p) - now
            if at < h - real(INSTANT):
                waiting = True
                passed = wp.max(at, real(0.0))
                true = cell.before[d] + rate * passed
                value = lagged(cell.force[d], true, rate, passed, lag)
                force[out + due][d] = cell_effects(value, row_time, d, p)
                due = due + 1
    return due
