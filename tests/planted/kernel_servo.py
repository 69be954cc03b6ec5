"""The plant's servo and tendon: from a command to the tension at the load cell."""

import warp as wp

from tests.planted.kernel_plant import HALF, ONE, ZERO, Plant

CURVATURE_SPEED = wp.constant(wp.float64(20.0))  # [rad/s] where viscous_curvature is the excess
KNEE = wp.constant(wp.float64(0.05))  # width of a planted saturation's knee, against its limit
ROUNDS = wp.constant(2)  # of Newton's method for a tendon that stretches, from a step ago


@wp.struct
class Line:
    """State of servo and tendon."""

    excursion: wp.float64  # [m] wound in by the mechanism's end
    speed: wp.float64  # [m/s]
    bend: wp.float64  # of the bristles, as a share of their greatest
    motor: wp.float64  # [N] lagging motor force, half a step ago
    tension: wp.float64  # [N] a step ago
    mount: wp.float64  # [m] by which the servo has given way
    mount_speed: wp.float64  # [m/s]
    gain: wp.float64  # [N/rad] now
    dry: wp.float64  # [N] further dry friction now


@wp.func
def taut_angle(p: Plant, s: Line, tension: wp.float64) -> wp.float64:
    """Motor angle [rad] while the tendon is taut."""
    wound = s.excursion + s.mount + p.slack + p.compliance * tension
    return wound / p.radius + p.offset


@wp.func
def motor_force(p: Plant, s: Line, command: wp.float64, angle: wp.float64) -> wp.float64:
    """Force that the servo asks of its motor [N], at most its limit, either way."""
    error = command - angle
    error = wp.sign(error) * wp.max(ZERO, wp.abs(error) - p.deadband)
    force = s.gain * error
    if p.cogging != ZERO:
        force += p.cogging * wp.sin(p.cogging_rate * angle + p.cogging_phase)
    if p.dead_spot != ZERO:
        away = (angle - p.dead_spot_at) / p.dead_spot_width
        force *= ONE - p.dead_spot * wp.exp(-away * away)
    if p.saturation != ZERO:
        return soft_limit(force, p.saturation)
    return wp.clamp(force, -p.limit, p.limit)


@wp.func
def soft_limit(force: wp.float64, limit: wp.float64) -> wp.float64:
    """Force that nears its limit gradually [N], as a motor's current does."""
    room = (limit - wp.abs(force)) / (KNEE * limit)
    left = wp.log(ONE + wp.exp(-wp.abs(room))) + wp.max(ZERO, room)
    return wp.sign(force) * wp.max(ZERO, limit - KNEE * limit * left)


@wp.func
def dry_friction(p: Plant, s: Line) -> wp.float64:
    """Force at which the bristles give way at this speed [N], load aside."""
    force = p.coulomb + s.dry
    if p.excess != ZERO:
        pace = s.speed / (p.nominal_radius * p.stribeck_speed)
        force += p.excess * wp.exp(-pace * pace)
    return force


@wp.func
def tension(p: Plant, s: Line, command: wp.float64) -> wp.float64:
    """Tension at the load cell [N]: motor force less friction, never a push.

    Load-dependent friction is ``load * tension * bend``, so the tension stands on both sides; if
    the tendon stretches it stands in the motor angle and its speed too.
    """
    share = ONE
    lagging = wp.bool(p.lag_share < ONE)
    if lagging:
        share = HALF * p.lag_share  # the force now is between those half a step ago and hence
    dry = dry_friction(p, s) * s.bend
    divisor = ONE + p.load * s.bend
    stretch = p.compliance / p.radius
    slope = stretch * (s.gain * share + p.viscous / p.step) / divisor
    pull = s.tension
    rounds = wp.int32(1)
    if p.compliance != ZERO:
        rounds = ROUNDS
    for _ in range(rounds):
        rate = (s.speed + s.mount_speed) / p.radius + stretch * (pull - s.tension) / p.step
        motor = motor_force(p, s, command, taut_angle(p, s, pull))
        if lagging:
            motor = s.motor + share * (motor - s.motor)
        viscous = p.viscous * rate * (ONE + p.curvature * wp.abs(rate) / CURVATURE_SPEED)
        asked = (motor - viscous - dry) / divisor
        pull = wp.max(ZERO, pull + (asked - pull) / (ONE + slope))
    return pull


@wp.func
def motor_angle(p: Plant, s: Line, command: wp.float64, pull: wp.float64) -> wp.float64:
    """Motor angle [rad]; of a loose tendon the motor is where its command is, within the slack."""
    taut = taut_angle(p, s, pull)
    if pull > ZERO or p.slack == ZERO:
        return taut
    return wp.clamp(command, taut - p.slack / p.radius, taut)
