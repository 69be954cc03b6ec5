"""What a force network is shown of a servo, and where its answer is kept."""

from __future__ import annotations

from typing import Any

import warp as wp

from tendon_newton.actuators.learned import hold_answer
from tendon_newton.actuators.networks.history import push_sample
from tendon_newton.device_code.placeholders import (
    TENDONS,
    DeviceArray,
    DeviceGrid,
    JointVector,
    MemoryVector,
    ParameterVector,
    Placeholder,
    Vec3,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.dynamics.sensors import read_sensors
from tendon_newton.simulation.kernels.rollout_kernels import acting_row
from tendon_newton.simulation.tendons.pipeline import tendon_flow, tendon_state
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.world_drive import world_drive

Commands = Placeholder
Drive = Placeholder
Mechanism = Placeholder
Reading = Placeholder
Jet = Placeholder
error_effects: Any = None
period_effects: Any = None
HELD_MEMORY = 0
"""Where the held forces stand in a world's memory; what each is reckoned from stands behind."""


@device_template
def servo_sample(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    angle: real,
    rate: real,
) -> Vec3:
    """Return a sample: angle asked for [rad], angle [rad] and rate [rad/s] reported.

    What effects make of the position error, they make of the angle asked for: the network knows
    the error as a difference. The drive was located at q and v.
    """
    tendon = tendon_state(mechanism, world, p, drive, d, q, v, real(0.0))
    error = drive.command[d] - angle
    tendon.error = error
    acting = error_effects(Jet(error, real(0.0), real(0.0)), tendon, p)
    return Vec3(drive.command[d] + (acting[0] - error), angle, rate)


@device_template
def push_samples(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    q: JointVector,
    v: JointVector,
    reading: Reading,
    first: int,
    fill: int,
    ring: wp.array3d[wp.float32],
    newest: DeviceArray[int],
) -> None:
    """Add a world's samples to the ring, its first servo standing at `first`."""
    here = located(mechanism, world, drive, q, v)
    for d in range(TENDONS):
        sample = servo_sample(
            mechanism, world, p, here, d, q, v, reading.angle[d], reading.angle_rate[d]
        )
        single = wp.vec3f(wp.float32(sample[0]), wp.float32(sample[1]), wp.float32(sample[2]))
        push_sample(ring, newest, first + d, single, fill)


@device_template
def with_held(
    mechanism: Mechanism, world: int, d: int, force: real, memory: MemoryVector
) -> MemoryVector:
    """Return a memory in which tendon d holds a force [N], within what its servo can give.

    A motor pulls back as hard as forth; that a string never pushes is seen to behind its frictions.
    """
    out = memory
    limit = mechanism.force_limit[world][d]
    # not clamp(): it would make a bound of what is not a number
    held = force
    if force > limit:
        held = limit
    if force < -limit:
        held = -limit
    out[wp.static(HELD_MEMORY) + d] = held
    return out


@device_template
def with_present(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    d: int,
    q: JointVector,
    v: JointVector,
    memory: MemoryVector,
) -> MemoryVector:
    """Return a memory in which the force of tendon d is reckoned from the present motion.

    The drive was located at q and v.
    """
    out = memory
    tendon = tendon_state(mechanism, world, p, drive, d, q, v, real(0.0))
    flow = tendon_flow(mechanism, world, p, d, tendon)
    answer = hold_answer(p, flow.angle, tendon.angle_rate)
    out[wp.static(HELD_MEMORY) + TENDONS + d] = answer[0]
    return out


@device_template
def all_present(
    mechanism: Mechanism,
    world: int,
    p: ParameterVector,
    drive: Drive,
    q: JointVector,
    v: JointVector,
) -> MemoryVector:
    """Return a world's memory in which all forces are reckoned from the present motion."""
    here = located(mechanism, world, drive, q, v)
    memory = drive.memory
    for d in range(TENDONS):
        memory = with_present(mechanism, world, p, here, d, q, v, memory)
    return memory


@device_template
def sense_rows_kernel(
    first_world: int,
    mechanism: Mechanism,
    world_mechanism: DeviceArray[int],
    world_recording: DeviceArray[int],
    parameters: DeviceArray[ParameterVector],
    commands: Commands,
    rows: DeviceArray[int],
    fill: int,
    q: DeviceArray[JointVector],
    v: DeviceArray[JointVector],
    memory: DeviceArray[MemoryVector],
    ring: wp.array3d[wp.float32],
    newest: DeviceArray[int],
) -> None:
    """Show force networks each world in a row of its recording; below zero it has none left.

    From then on forces are reckoned from there.
    """
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue] - one dimension: a number
    world = world_mechanism[i]
    recording = world_recording[i]
    row = rows[recording]
    if row >= 0:
        first = commands.first[recording]
        p = parameters[i]
        scale = period_effects(real(1.0), p)
        drive = world_drive(mechanism, world, p)
        drive.time = commands.time[first + row] * scale
        drive.memory = memory[i]
        drive.voltage = commands.voltage[first + row]
        drive.enabled = commands.enabled[first + row]
        count = commands.count[recording]
        acting = acting_row(commands, first, count, drive.time, scale, p, row)
        drive.command = commands.angle[first + acting]
        reading = read_sensors(mechanism, world, p, drive, q[i], v[i])
        push_samples(
            mechanism, world, p, drive, q[i], v[i], reading, i * TENDONS, fill, ring, newest
        )
        memory[i] = all_present(mechanism, world, p, drive, q[i], v[i])


@device_template
def hold_rows_kernel(
    mechanism: Mechanism,
    world_mechanism: DeviceArray[int],
    force: DeviceGrid[wp.float32],
    memory: DeviceArray[MemoryVector],
) -> None:
    """Hold forces [N] in all worlds from now on."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    kept = memory[i]
    for d in range(TENDONS):
        kept = with_held(mechanism, world_mechanism[i], d, real(force[i, d]), kept)
    memory[i] = kept
