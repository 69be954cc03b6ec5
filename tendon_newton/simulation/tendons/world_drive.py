"""What acts on a world besides its own motion, and what the effects make of its numbers."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    DRY_OFFSETS,
    EFFECT_COUNT,
    FIRST_OWN,
    FREE_SPOOL,
    HAS_BODY,
    JOINTS,
    MEMORY_NULLS,
    MEMORY_OFFSETS,
    OWN_BITS,
    OWN_NULLS,
    SKIPS,
    SMOOTH_OFFSETS,
    TENDONS,
    TOUCHES,
    Flags,
    JointVector,
    MemoryVector,
    ParameterVector,
    TendonVector,
    real,
)
from tendon_newton.device_code.slots import (
    inertia_effects,
    joint_friction_effects,
    radius_effects,
    speed_effects,
    string_effects,
    tilt_effects,
)
from tendon_newton.device_code.structs import Drive, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.law.spool import UNBOUNDED
from tendon_newton.simulation.tendons.states import joint_state


@device_template
def world_drive(mechanism: Mechanism, world: int, p: ParameterVector) -> Drive:
    """Return a drive with what stays the same through a run; the caller adds time and command."""
    drive = Drive()
    drive.world = world
    drive.enabled = real(1.0)
    if wp.static(SKIPS):
        drive.asleep = sleepers(p)
    drive.inertia = inertia_effects(real(1.0), p)
    angle = tilt_effects(real(0.0), p)
    turned = mechanism.gravity[world] - wp.sin(angle) * mechanism.gravity_across[world]
    drive.gravity = turned - (real(1.0) - wp.cos(angle)) * mechanism.gravity_along[world]
    if wp.static(HAS_BODY):
        drive.tilt = angle
    friction = JointVector()
    greatest_speed = TendonVector()
    dry = real(0.0)
    for j in range(JOINTS):
        joint = joint_state(mechanism, drive, j)
        friction[j] = joint_friction_effects(mechanism.friction[world][j], joint, p)
    for d in range(TENDONS):
        radius = radius_effects(mechanism.spool_radius[world][d], d, p)
        speed = speed_effects(real(UNBOUNDED), d, p)
        greatest_speed[d] = wp.min(speed * radius, real(UNBOUNDED))
    for i in range(wp.static(len(DRY_OFFSETS))):
        dry = dry + wp.abs(p[wp.static(DRY_OFFSETS[i])])
    bristles = real(0.0)
    for i in range(wp.static(len(SMOOTH_OFFSETS))):
        bristles = bristles + p[wp.static(SMOOTH_OFFSETS[i])]
    if bristles > real(0.0):
        dry = -dry
    for i in range(wp.static(len(MEMORY_OFFSETS))):
        value = p[wp.static(MEMORY_OFFSETS[i])]
        null = real(wp.static(min(MEMORY_NULLS[i], UNBOUNDED)))
        if value != null and value < real(UNBOUNDED):
            drive.remembers = real(1.0)
    if wp.static(TOUCHES):
        drive.remembers = real(1.0)
    if wp.static(FREE_SPOOL):
        string = TendonVector()
        for d in range(TENDONS):
            string[d] = string_effects(real(UNBOUNDED), d, p)
        drive.string = string
    drive.friction = friction
    drive.greatest_speed = greatest_speed
    drive.dry = dry
    return drive


@device_template
def sleepers(p: ParameterVector) -> Flags:
    """Return which effects have all their parameters at null, a bit each."""
    asleep = Flags(wp.static((1 << EFFECT_COUNT) - 1))
    for n in range(wp.static(len(OWN_BITS))):
        value = wp.min(p[wp.static(FIRST_OWN + n)], real(UNBOUNDED))
        if value != real(wp.static(min(OWN_NULLS[n], UNBOUNDED))):
            asleep = asleep & Flags(wp.static(~(1 << OWN_BITS[n])))
    return asleep


@device_template
def at_start(drive: Drive, time: real, memory: MemoryVector) -> Drive:
    """Return the drive at the start of a step at a time [s]."""
    start = drive
    start.time = time
    start.elapsed = real(0.0)
    start.acceleration = JointVector()
    start.memory = memory
    return start


@device_template
def at_end(drive: Drive, elapsed: real, acceleration: JointVector) -> Drive:
    """Return the drive some time [s] into a step, with the acceleration since its start."""
    end = drive
    end.time = drive.time + elapsed
    end.elapsed = elapsed
    end.acceleration = acceleration
    return end


@device_template
def in_same_mode(drive: Drive, slack: TendonVector) -> Drive:
    """Return a drive whose strings stay taut or slack as they were at the start of a step."""
    out = drive
    out.slack = slack
    return out
