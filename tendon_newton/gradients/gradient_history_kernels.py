"""Kernels between a taped rollout and a force network: what it is shown, and what it answers."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    TENDONS,
    DeviceArray,
    DeviceGrid,
    ParameterVector,
    TendonVector,
    Vec3,
)
from tendon_newton.device_code.structs import Commands, Drive, Mechanism, Query, StateRows
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.contact_states import choose_contact_states
from tendon_newton.simulation.kernels.acting_command import just_after_row, log_of
from tendon_newton.simulation.kernels.history_kernels import all_present, servo_sample, with_held
from tendon_newton.simulation.tendons.routes import located, tendon_arms
from tendon_newton.simulation.tendons.states import excursion, flow_at


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
