"""Dry friction and a motor's greatest speed as springs, as stiff as a step allows."""

import warp as wp

from tendon_newton.device_code.placeholders import ParameterVector, real
from tendon_newton.device_code.slots import speed_effects
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import device_template
from tendon_newton.exports.newton.drive_structs import DriveBench, Kept
from tendon_newton.law.spool import UNBOUNDED

GRIP = 0.3  # Turns [rad] that a stiff spring's oscillation may take in one step
# Share of an inertia's momentum [1] that its damper takes in one step: seven tenths critical
GRIP_DAMPING = 0.42
# What a motor at its greatest speed holds against, in shares of its greatest force [1]
OUTRUN = 4.0
STUCK = 1.0e-3  # Share of its span [1] by which friction that sticks is away from sliding


@device_template
def bent_share(bend: real, speed: real, half: real, inertia: real, step: real) -> real:
    """Return where dry friction of +-half [N] is between sliding in (0) and out (1)."""
    share = real(0.5)
    if half > real(0.0):
        pace = real(GRIP) / step
        force = inertia * (pace * pace * bend + real(GRIP_DAMPING) / step * speed)
        share = real(0.5) * (real(1.0) - wp.clamp(force / half, real(-1.0), real(1.0)))
    return share


@device_template
def bent_on(bend: real, speed: real, half: real, inertia: real, step: real) -> real:
    """Return how far dry friction has bent [m] a step later."""
    pace = real(GRIP) / step
    most = wp.max(half, real(0.0)) / (inertia * pace * pace)
    return wp.clamp(bend + speed * step, -most, most)


@device_template
def rebent(before: Kept, inward: real, half: real, bench: DriveBench) -> real:
    """Return how far dry friction is bent [m] under a new command.

    What sticks takes up what the motor gives more or less, as far as it can.
    """
    bend = before.bend
    if half > real(0.0) and before.share > real(STUCK) and before.share < real(1.0) - real(STUCK):
        pace = real(GRIP) / bench.step
        share = wp.clamp(real(0.5) * (before.pull - inward) / half, real(0.0), real(1.0))
        bend = (real(1.0) - real(2.0) * share) * half / (bench.inertia * pace * pace)
    return bend


@device_template
def joint_grip(limit: real, joint: Joint, kept: Kept, bench: DriveBench) -> real:
    """Return what dry friction of a joint gives [N m]."""
    share = bent_share(kept.joint_bend, joint.velocity, limit, bench.joint_inertia, bench.step)
    return (real(2.0) * share - real(1.0)) * limit


@device_template
def outrun_by(before: real, tendon: Tendon, p: ParameterVector, bench: DriveBench) -> real:
    """Return how far a tendon has outrun its motor [m], which without a rotor has no speed."""
    most = speed_effects(real(UNBOUNDED), 0, p) * tendon.spool_radius
    after = real(0.0)
    if before > real(0.0) or tendon.velocity > most:
        after = wp.max(before + (tendon.velocity - most) * bench.step, real(0.0))
    if before < real(0.0) or tendon.velocity < -most:
        after = wp.min(before + (tendon.velocity + most) * bench.step, real(0.0))
    return after


@device_template
def held_back(outrun: real, tendon: Tendon, p: ParameterVector, bench: DriveBench) -> real:
    """Return what holds a tendon back that has outrun its motor [N]."""
    most = speed_effects(real(UNBOUNDED), 0, p) * tendon.spool_radius
    force = real(0.0)
    if outrun != real(0.0):
        pace = real(GRIP) / bench.step
        over = tendon.velocity - wp.sign(outrun) * most
        force = bench.inertia * (pace * pace * outrun + real(GRIP_DAMPING) / bench.step * over)
    most_held = real(OUTRUN) * tendon.force_limit
    return real(wp.clamp(force, -most_held, most_held))
