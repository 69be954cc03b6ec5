"""What encoder and load cell report."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.first_order_lag import lagged
from tendon_newton.device_code.placeholders import (
    TENDONS,
    DeviceArray,
    JointVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.forces import smooth_forces
from tendon_newton.simulation.dynamics.memory import remembered
from tendon_newton.simulation.dynamics.modes import choose_modes, constrained_solve
from tendon_newton.simulation.tendons.pipeline import servo_flow, tendon_state
from tendon_newton.simulation.tendons.routes import located, row_arms, row_bow
from tendon_newton.simulation.tendons.tension import tension_now

Cell = Placeholder
Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Modes = Placeholder
Reading = Placeholder
cell_effects: Any = None
cell_clock_effects: Any = None
cell_lag_effects: Any = None
encoder_effects: Any = None
HAS_MEMORY = False
HAS_ROTOR = False
"""Whether a rotor's inertia stands between the motor and the load cell."""

INSTANT = 1.0e-6
"""Instants [s] closer than this are one."""


@device_template
def accelerations(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
) -> JointVector:
    """Return the accelerations [rad/s2, m/s2] that a rotor feels; without one nobody asks.

    The drive was located at q and v.
    """
    out = JointVector()
    if wp.static(HAS_ROTOR):
        forces = smooth_forces(mechanism, world, p, drive, modes, q, v)
        rows = row_arms(mechanism, world, drive, modes)
        out = constrained_solve(forces.mass_matrix, forces.torque, modes, rows, row_bow(drive))
    return out


@device_template
def tensions_in(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    modes: Modes,
    q: JointVector,
    v: JointVector,
) -> TendonVector:
    """Return the tensions at the load cells [N] in known modes; a string never pushes.

    The drive was located at q and v.
    """
    acceleration = accelerations(mechanism, world, p, drive, modes, q, v)
    out = TendonVector()
    for d in range(TENDONS):
        tension = tension_now(mechanism, world, p, drive, modes, d, q, v, acceleration)
        if wp.static(HAS_ROTOR):
            tension = wp.max(tension, mechanism.least_tension[world][d])
        out[d] = tension
    return out


@device_template
def tensions(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    q: JointVector,
    v: JointVector,
) -> TendonVector:
    """Return the tensions at the load cells [N]."""
    here = located(mechanism, world, drive, q, v)
    modes = choose_modes(mechanism, world, p, here, q, v)
    return tensions_in(mechanism, world, p, here, modes, q, v)


@device_template
def read_sensors(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    q: JointVector,
    v: JointVector,
) -> Reading:
    """Return the encoder's report just after a command took effect, and the true tension then."""
    here = located(mechanism, world, drive, q, v)
    modes = choose_modes(mechanism, world, p, here, q, v)
    reading = Reading()
    now = here
    if wp.static(HAS_MEMORY):  # noqa: SIM102 - known when compiled
        if drive.remembers > real(0.0):
            now.memory = remembered(mechanism, world, p, here, modes, q, v)
    reading.force = tensions_in(mechanism, world, p, here, modes, q, v)
    for d in range(TENDONS):
        tendon = tendon_state(mechanism, world, p, now, d, q, v, modes.tendon[d])
        flow = servo_flow(mechanism, world, p, d, tendon)
        tendon.tension = reading.force[d]
        angle = encoder_effects(flow.angle, tendon, p)
        reading.angle[d] = angle[0]
        reading.angle_rate[d] = angle[1] * tendon.velocity
    return reading


@device_template
def cell_is_slow(p: ParameterVector) -> bool:
    """Tell whether the load cell is late or lags: its readings need the force between rows."""
    lag = cell_lag_effects(real(0.0), p)
    return lag > real(0.0) or cell_clock_effects(real(0.0), p) != real(0.0)


@device_template
def first_due(
    commands: Commands, first: int, count: int, rows_from: int, scale: real, p: ParameterVector
) -> int:
    """Return the first row whose reading belongs to what follows a row's instant."""
    due = int(0)  # noqa: UP018, RUF046 - a variable for Warp, not a constant
    if rows_from > 0:
        now = commands.time[first + rows_from] * scale
        while due < count and (
            cell_clock_effects(commands.time[first + due] * scale, p) < now - real(INSTANT)
        ):
            due = due + 1
    return due


@device_template
def report(
    commands: Commands,
    first: int,
    count: int,
    scale: real,
    p: ParameterVector,
    cell: Cell,
    now: real,
    h: real,
    before: TendonVector,
    after: TendonVector,
    out: int,
    force: DeviceArray[TendonVector],
) -> Cell:
    """Write the readings that belong to a substep of h [s], in which the tension moves evenly."""
    lag = cell_lag_effects(real(0.0), p)
    rate = (after - before) / h
    waiting = bool(True)  # noqa: UP018 - a variable for Warp, not a constant
    while waiting:
        waiting = False
        if cell.due < count:
            row_time = commands.time[first + cell.due] * scale
            at = cell_clock_effects(row_time, p) - now
            if at < h - real(INSTANT):
                waiting = True
                passed = wp.max(at, real(0.0))
                for d in range(TENDONS):
                    true = before[d] + rate[d] * passed
                    value = lagged(cell.force[d], true, rate[d], passed, lag)
                    force[out + cell.due][d] = cell_effects(value, row_time, p)
                cell.due = cell.due + 1
    for d in range(TENDONS):
        cell.force[d] = lagged(cell.force[d], after[d], rate[d], h, lag)
    return cell
