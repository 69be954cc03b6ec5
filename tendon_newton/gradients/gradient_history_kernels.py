"""Kernels between a taped rollout and a force network: what it is shown, and what it answers."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.device_code.placeholders import (
    TENDONS,
    DeviceArray,
    DeviceGrid,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    TendonVector,
    Vec3,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.gradients.substep_kernels import row_drive, with_command
from tendon_newton.simulation.dynamics.modes import choose_modes
from tendon_newton.simulation.kernels.history_kernels import all_present, servo_sample, with_held
from tendon_newton.simulation.kernels.rollout_kernels import acting_row
from tendon_newton.simulation.tendons.pipeline import excursion, flow_at
from tendon_newton.simulation.tendons.routes import located, tendon_arms

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
period_effects: Any = None


@device_template
def query_drive(
    mechanism: Mechanism,
    i: int,
    p: ParameterVector,
    commands: Commands,
    row: int,
    memory: MemoryVector,
) -> Drive:
    """Return what acts on a world in the row of a query, just after its command took effect."""
    first = commands.first[i]
    scale = period_effects(real(1.0), p)
    now = commands.time[first + row] * scale
    acting = acting_row(commands, first, commands.count[i], now, scale, p, row)
    plain = row_drive(mechanism, i, p, commands, first + row, now, memory)
    return with_command(plain, commands.angle[first + acting], real(0.0))


@device_template
def taped_sense_kernel(
    slot: int,
    query: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    query_row: DeviceGrid[int],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
    samples: DeviceGrid[Vec3],
) -> None:
    """Write what a network is shown of each world in the row of a query."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    p = parameters[i]
    x = q[slot, i]
    xd = v[slot, i]
    driven = query_drive(mechanism, i, p, commands, query_row[query, i], memory[slot, i])
    drive = located(mechanism, i, driven, x, xd)
    arms = tendon_arms(mechanism, i, drive)
    modes = choose_modes(mechanism, i, p, drive, x, xd)
    for d in range(TENDONS):
        flow = flow_at(mechanism, i, p, drive, d, x, xd, modes.tendon[d])
        rate = flow.angle[1] * excursion(arms, d, xd)
        samples[query, i * TENDONS + d] = servo_sample(
            mechanism, i, p, drive, d, x, xd, flow.angle[0], rate
        )


@device_template
def taped_hold_kernel(
    slot: int,
    query: int,
    mechanism: Mechanism,
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    query_row: DeviceGrid[int],
    force: DeviceGrid[TendonVector],
    q: DeviceGrid[JointVector],
    v: DeviceGrid[JointVector],
    memory: DeviceGrid[MemoryVector],
) -> None:
    """Go on from a slot of the states to the next, with the forces [N] of a query held."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    p = parameters[i]
    drive = query_drive(mechanism, i, p, commands, query_row[query, i], memory[slot, i])
    kept = all_present(mechanism, i, p, drive, q[slot, i], v[slot, i])
    for d in range(TENDONS):
        kept = with_held(mechanism, i, d, force[query, i][d], kept)
    q[slot + 1, i] = q[slot, i]
    v[slot + 1, i] = v[slot, i]
    memory[slot + 1, i] = kept
