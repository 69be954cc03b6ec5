"""What a force network is shown of a servo, and where its answer is kept."""

from __future__ import annotations

import warp as wp

from tendon_newton.actuators.learned import hold_answer
from tendon_newton.actuators.networks.history import push_sample
from tendon_newton.device_code.placeholders import (
    HELD_MEMORY,
    TENDONS,
    DeviceArray,
    DeviceGrid,
    Jet,
    MemoryVector,
    ParameterVector,
    Vec3,
    real,
)
from tendon_newton.device_code.slots import error_effects
from tendon_newton.device_code.structs import (
    Commands,
    Drive,
    Mechanism,
    Reading,
    Samples,
    States,
    Worlds,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.string import tendon_flow
from tendon_newton.simulation.dynamics.sensors import read_sensors
from tendon_newton.simulation.kernels.acting_command import just_after_row, log_of
from tendon_newton.simulation.tendons.routes import located
from tendon_newton.simulation.tendons.states import tendon_state


@device_template
def servo_sample(
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, angle: real, rate: real
) -> Vec3:
    """Return a sample: angle asked for [rad], angle [rad] and rate [rad/s] reported.

    What effects make of the position error, they make of the angle asked for: the network knows
    the error as a difference.
    """
    tendon = tendon_state(mechanism, p, here, d, real(0.0))
    error = here.command[d] - angle
    tendon.error = error
    acting = error_effects(Jet(error, real(0.0), real(0.0)), tendon, p)
    return Vec3(here.command[d] + (acting[0] - error), angle, rate)


@device_template
def push_samples(
    mechanism: Mechanism,
    p: ParameterVector,
    here: Drive,
    reading: Reading,
    first: int,
    fill: int,
    samples: Samples,
) -> None:
    """Add a world's samples to the ring, its first servo standing at `first`."""
    for d in range(TENDONS):
        sample = servo_sample(mechanism, p, here, d, reading.angle[d], reading.angle_rate[d])
        single = wp.vec3f(wp.float32(sample[0]), wp.float32(sample[1]), wp.float32(sample[2]))
        push_sample(samples.ring, samples.newest, first + d, single, fill)


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
    mechanism: Mechanism, p: ParameterVector, here: Drive, d: int, memory: MemoryVector
) -> MemoryVector:
    """Return a memory in which the force of tendon d is reckoned from the present motion."""
    out = memory
    tendon = tendon_state(mechanism, p, here, d, real(0.0))
    flow = tendon_flow(tendon, p)
    answer = hold_answer(p, flow.angle, tendon.angle_rate)
    out[wp.static(HELD_MEMORY) + TENDONS + d] = answer[0]
    return out


@device_template
def all_present(mechanism: Mechanism, p: ParameterVector, here: Drive) -> MemoryVector:
    """Return a world's memory in which all forces are reckoned from the present motion."""
    memory = here.memory
    for d in range(TENDONS):
        memory = with_present(mechanism, p, here, d, memory)
    return memory


@device_template
def sense_rows_kernel(
    first_world: int,
    mechanism: Mechanism,
    worlds: Worlds,
    commands: Commands,
    rows: DeviceArray[int],
    fill: int,
    states: States,
    samples: Samples,
) -> None:
    """Show force networks each world in a row of its recording; below zero it has none left.

    From then on forces are reckoned from there.
    """
    i = first_world + wp.tid()  # pyright: ignore[reportOperatorIssue]
    world = worlds.mechanism[i]
    recording = worlds.recording[i]
    row = rows[recording]
    if row >= 0:
        p = worlds.parameters[i]
        log = log_of(commands, recording, p)
        drive = just_after_row(mechanism, world, p, commands, log, row, states.memory[i])
        here = located(mechanism, drive, states.q[i], states.v[i])
        reading = read_sensors(mechanism, p, here)
        push_samples(mechanism, p, here, reading, i * TENDONS, fill, samples)
        states.memory[i] = all_present(mechanism, p, here)


@device_template
def hold_rows_kernel(
    mechanism: Mechanism, worlds: Worlds, force: DeviceGrid[wp.float32], states: States
) -> None:
    """Hold forces [N] in all worlds from now on."""
    i = int(wp.tid())  # pyright: ignore[reportArgumentType]
    kept = states.memory[i]
    for d in range(TENDONS):
        kept = with_held(mechanism, worlds.mechanism[i], d, real(force[i, d]), kept)
    states.memory[i] = kept
