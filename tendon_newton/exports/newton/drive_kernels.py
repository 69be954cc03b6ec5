"""Kernels of a drive: the force of each slot, what it remembers, and what it reports."""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    HELD_MEMORY,
    DeviceArray,
    DeviceBlock,
    DeviceGrid,
    Jet,
    ParameterVector,
    real,
)
from tendon_newton.device_code.slots import (
    error_effects,
    joint_friction_effects,
    radius_effects,
    spring_memory,
)
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.exports.newton.device import answered, at_rest
from tendon_newton.exports.newton.drive_structs import DriveBench, JointMore, Kept, Report, Way
from tendon_newton.exports.newton.grips import bent_on, joint_grip
from tendon_newton.law.joint import damping_torque, spring_torque
from tendon_newton.law.spool import SETTLED


@device_template
def power(x: real, n: int) -> real:
    """Return a power of a number."""
    out = real(1.0)
    for _ in range(n):
        out = out * x
    return out


@device_template
def excursion(
    d: int,
    terms: int,
    factor: DeviceGrid[real],
    powers: DeviceBlock[int],
    q: DeviceArray[wp.float32],
    first: int,
    by: int,
) -> real:
    """Return l, or its derivative by one joint."""
    total = real(0.0)
    for k in range(terms):
        product = factor[d, k]
        for j in range(powers.shape[2]):
            n = powers[d, k, j]
            if j == by:
                product = product * real(n)
                n = wp.max(n - 1, 0)
            product = product * power(real(q[first + j]), n)
        total = total + product
    return total


@device_template
def stop_torque(joint: Joint, stiffness: real, damping: real) -> real:
    """Return what an end stop gives, which never pulls."""
    over = joint.position - wp.clamp(joint.position, joint.lower, joint.upper)
    push = stiffness * over + damping * joint.velocity
    torque = real(0.0)
    if over != real(0.0) and push * over > real(0.0):
        torque = -push
    return torque


@device_template
def drive_kernel(
    position: DeviceArray[wp.float32],
    velocity: DeviceArray[wp.float32],
    target: DeviceArray[wp.float32],
    position_index: DeviceArray[wp.uint32],
    velocity_index: DeviceArray[wp.uint32],
    target_index: DeviceArray[wp.uint32],
    tendon_of: DeviceArray[int],
    joint_of: DeviceArray[int],
    paths: DeviceArray[Way],
    factor: DeviceGrid[real],
    powers: DeviceBlock[int],
    joints: DeviceArray[Joint],
    joints_more: DeviceArray[JointMore],
    parameters: DeviceArray[ParameterVector],
    voltage: DeviceArray[real],
    enabled: DeviceArray[real],
    fresh: DeviceArray[int],
    before: DeviceArray[Kept],
    log: DeviceGrid[real],
    late: int,
    step: real,
    force: DeviceArray[wp.float32],
    after: DeviceArray[Kept],
    report: DeviceArray[Report],
) -> None:
    """Write the force of each slot, what it remembers, and what it reports."""
    i = wp.tid()
    d = tendon_of[i]
    j = joint_of[i]
    p = parameters[i]
    path = paths[d]
    first = int(position_index[i]) - j
    first_rate = int(velocity_index[i]) - j
    tendon = Tendon()
    tendon.voltage = voltage[i]
    tendon.enabled = enabled[i]
    tendon.force_limit = path.limit
    tendon.least_tension = path.least
    tendon.command = real(target[target_index[i]])
    tendon.nominal_radius = path.radius
    tendon.spool_radius = radius_effects(path.radius, 0, p)
    tendon.inverse_radius = real(1.0) / tendon.spool_radius
    tendon.length = excursion(d, path.terms, factor, powers, position, first, -1)
    tendon.wound = tendon.length
    arm = real(0.0)
    for k in range(powers.shape[2]):
        slope = excursion(d, path.terms, factor, powers, position, first, k)
        tendon.velocity = tendon.velocity + slope * real(velocity[first_rate + k])
        if k == j:
            arm = slope
    tendon.angle_rate = Jet(tendon.velocity, real(0.0), real(1.0)) * tendon.inverse_radius
    bench = DriveBench()
    bench.inertia = path.inertia
    bench.rotor = path.rotor
    bench.step = step
    more = joints_more[j]
    bench.joint_inertia = more.inertia
    joint = joints[j]
    joint.position = real(position[int(position_index[i])])
    joint.velocity = real(velocity[int(velocity_index[i])])
    kept = before[i]
    joint.memory = kept.memory
    joint.elapsed = step
    tendon.memory = kept.memory
    depth = log.shape[1]
    if fresh[i] != 0:
        kept.count = 0
        for k in range(depth):
            log[i, k] = tendon.command
    log[i, kept.count % depth] = tendon.command
    tendon.command = log[i, (kept.count + depth - late) % depth]
    if fresh[i] != 0:
        kept = at_rest(tendon, p, bench)
        joint.elapsed = real(SETTLED)
        joint.memory = kept.memory
    kept.memory = spring_memory(spring_torque(joint, p), joint, p, kept.memory)
    tendon.memory = kept.memory
    answer = answered(tendon, p, kept, bench)
    joint.memory = answer.kept.memory
    joint.elapsed = real(0.0)
    own = spring_torque(joint, p) + damping_torque(joint, p)
    plain = more.stiffness * (joint.position - joint.rest) + more.damping * joint.velocity
    stop = stop_torque(joint, more.stop_stiffness, more.stop_damping)
    limit = joint_friction_effects(more.friction, joint, p)
    grip = joint_grip(limit, joint, answer.kept, bench)
    force[i] = wp.float32(arm * answer.pull + own[0] + plain + stop + grip)
    kept = answer.kept
    kept.joint_bend = bent_on(kept.joint_bend, joint.velocity, limit, more.inertia, step)
    after[i] = kept
    out = Report()
    out.angle = answer.angle
    out.rate = answer.rate
    out.tension = answer.tension
    out.tension_gain = answer.tension_gain
    out.pull_gain = answer.pull_gain
    out.spool_change = answer.spool_change
    raw = Jet(tendon.command - answer.angle, real(0.0), real(0.0))
    tendon.error = raw[0]
    acting = error_effects(raw, tendon, p)
    out.asked = tendon.command + acting[0] - raw[0]
    report[i] = out


@device_template
def copy_kernel(source: DeviceArray[Kept], out: DeviceArray[Kept], fresh: DeviceArray[int]) -> None:
    """Copy what slots remember; none is fresh then."""
    i = wp.tid()
    out[i] = source[i]
    fresh[i] = 0


@device_template
def hold_kernel(
    force: DeviceArray[real], answer: DeviceArray[real], kept: DeviceArray[Kept]
) -> None:
    """Hold forces [N] of a network from now on, and what each is reckoned from."""
    i = wp.tid()
    one = kept[i]
    one.memory[wp.static(HELD_MEMORY)] = force[i]
    one.memory[wp.static(HELD_MEMORY) + 1] = answer[i]
    kept[i] = one


@device_template
def fresh_kernel(mask: DeviceArray[wp.bool], fresh: DeviceArray[int]) -> None:
    """Let slots begin anew at their next step."""
    i = wp.tid()
    if mask[i]:
        fresh[i] = 1
