"""The plant's servo: from a command to the motor's force, and what its gear keeps of it."""

import warp as wp

from tests.planted.physics.kernel_plant import HALF, ONE, ZERO, Plant, bend_after, beyond

CURVATURE_SPEED = wp.constant(wp.float64(20.0))  # [rad/s] where viscous_curvature is the excess
EDGE = wp.constant(wp.float64(0.1))  # width of a deadband's rounded edge, against the deadband


@wp.struct
class Line:
    """State of servo and tendon."""

    excursion: wp.float64  # [m] wound in by the mechanism's end
    speed: wp.float64  # [m/s]
    gear: wp.float64  # bend of the gear's bristles, as a share of their greatest, a step ago
    slid: wp.float64  # [m] of the mechanism's end and the mount since then
    dahl: wp.float64  # the same of the softer bristles
    guide: wp.float64  # of those between string and guides
    motor: wp.float64  # [N] lagging motor force, half a step ago
    weakness: wp.float64  # of a motor that fades [1]
    tension: wp.float64  # [N] a step ago
    mount: wp.float64  # [m] by which the servo has given way
    mount_speed: wp.float64  # [m/s]
    gain: wp.float64  # of the servo against its nominal [1]
    dry: wp.float64  # [N] further dry friction now
    angle: wp.float64  # [rad] of the rotor, without the encoder's offset
    rate: wp.float64  # [rad/s]
    half_rate: wp.float64  # [rad/s] half a step ago
    turning: wp.float64  # [rad/s^2]
    goal: wp.float64  # [rad] that the servo makes of its command
    goal_rate: wp.float64  # [rad/s]
    overloaded: wp.float64  # [s] so far, negative where it pays out


@wp.func
def taut_angle(p: Plant, s: Line, tension: wp.float64) -> wp.float64:
    """Motor angle [rad] of an ideal source while the tendon is taut, play aside."""
    wound = s.excursion + s.mount + p.slack + p.compliance * tension
    return wound / p.radius + p.offset


@wp.func
def motor_force(
    p: Plant, s: Line, command: wp.float64, angle: wp.float64, rate: wp.float64
) -> wp.float64:
    """Force of the motor [N] at an angle [rad] and a rate [rad/s], limited either way."""
    error = s.gain * past_deadband(p, command - angle)
    force = effort(p, s, p.gain * error / p.limit) * p.limit
    if p.rotor > ZERO:
        duty = effort(p, s, p.duty_per_rad * error)
        duty = wp.clamp(duty, -p.greatest_duty, p.greatest_duty)
        current = (duty * p.supply - p.torque_constant * rate) / p.resistance
        force = p.torque_constant * current / p.radius
    if p.cogging != ZERO:
        force += p.cogging * wp.sin(p.cogging_rate * angle + p.cogging_phase)
    if p.dead_spot != ZERO:
        away = (angle - p.dead_spot_at) / p.dead_spot_width
        force *= ONE - p.dead_spot * wp.exp(-away * away)
    if p.saturation != ZERO:
        force = soft_limit(force, p.saturation, p.knee)
    else:
        force = wp.clamp(force, -p.limit, p.limit)
    force /= ONE + p.sag * wp.abs(force)
    return force / (ONE + s.weakness)


@wp.func
def effort(p: Plant, s: Line, demand: wp.float64) -> wp.float64:
    """Share of all it has that a servo gives [1] where its loop asks for that much."""
    share = demand
    if demand != ZERO:
        share += wp.sign(demand) * p.starting_duty
    if protects_itself(p, s) and demand * s.overloaded > ZERO:
        share = wp.clamp(share, -p.protective, p.protective)
    return share


@wp.func
def protects_itself(p: Plant, s: Line) -> wp.bool:
    """Whether an overload has lasted too long."""
    return p.protection_time > ZERO and wp.abs(s.overloaded) >= p.protection_time


@wp.func
def overloaded_after(p: Plant, s: Line, error: wp.float64) -> wp.float64:
    """Time of overload [s] a step later, at a position error [rad]."""
    error = s.gain * past_deadband(p, error)
    share = p.gain * error / p.limit
    if p.rotor > ZERO:
        share = p.duty_per_rad * error
    if share * s.overloaded >= ZERO and protects_itself(p, s):
        return s.overloaded
    if wp.abs(effort(p, s, share)) <= p.overload:
        return ZERO
    if share * s.overloaded < ZERO:
        return wp.sign(share) * p.step
    return s.overloaded + wp.sign(share) * p.step


@wp.func
def goal_after(p: Plant, s: Line, command: wp.float64) -> Line:
    """Goal of a servo a step later: it may speed up and turn no faster than its profile says."""
    out = s
    far = command - s.goal
    rate = far / p.step
    if p.goal_acceleration > ZERO:
        # the speed from which it can still brake, less what it gains within a step
        brake = p.goal_acceleration * p.step
        may = wp.sqrt(wp.float64(2.0) * p.goal_acceleration * wp.abs(far) + brake * brake) - brake
        rate = wp.sign(far) * wp.min(may, wp.abs(rate))
        rate = wp.clamp(rate, s.goal_rate - brake, s.goal_rate + brake)
    if p.goal_rate > ZERO:
        rate = wp.clamp(rate, -p.goal_rate, p.goal_rate)
    out.goal_rate = rate
    out.goal = s.goal + p.step * rate
    return out


@wp.func
def lagging(p: Plant, s: Line, target: wp.float64) -> wp.float64:
    """Force of a lagging motor now [N], between those half a step ago and hence."""
    if p.lag_share < ONE:
        return s.motor + HALF * p.lag_share * (target - s.motor)
    return target


@wp.func
def soft_limit(force: wp.float64, limit: wp.float64, knee: wp.float64) -> wp.float64:
    """Force that nears its limit gradually [N], as a motor's current does."""
    left = rounded_up(limit - wp.abs(force), knee * limit)
    return wp.sign(force) * wp.max(ZERO, limit - left)


@wp.func
def rounded_up(value: wp.float64, width: wp.float64) -> wp.float64:
    """Value where it is positive and nearly zero elsewhere, with a knee of this width."""
    share = value / width
    return width * (wp.log(ONE + wp.exp(-wp.abs(share))) + wp.max(ZERO, share))


@wp.func
def past_deadband(p: Plant, error: wp.float64) -> wp.float64:
    """Error that the servo acts on [rad]; in the second form the deadband's edge is round."""
    if p.rounded == 0 or p.deadband == ZERO:
        return beyond(error, p.deadband)
    return wp.sign(error) * rounded_up(wp.abs(error) - p.deadband, EDGE * p.deadband)


@wp.func
def viscous_friction(p: Plant, rate: wp.float64) -> wp.float64:
    """Force lost to the motor's rate [N]."""
    return p.viscous * rate * (ONE + p.curvature * wp.abs(rate) / CURVATURE_SPEED)


@wp.func
def dry_friction(p: Plant, s: Line, speed: wp.float64) -> wp.float64:
    """Force at which the gear's bristles give way at this speed [N], load aside."""
    side = p.winding
    if s.gear < ZERO:
        side = p.unwinding
    return p.coulomb + side + s.dry + at_low_speed(p, p.excess, speed)


@wp.func
def at_low_speed(p: Plant, excess: wp.float64, speed: wp.float64) -> wp.float64:
    """What is left at this speed of what bristles hold more at rest: Gauss, or Hess and Soom."""
    if excess == ZERO:
        return ZERO
    pace = speed / (p.nominal_radius * p.stribeck_speed)
    if p.rounded != 0:
        return excess / (ONE + pace * pace)
    return excess * wp.exp(-pace * pace)


@wp.func
def gear_load(p: Plant, speed: wp.float64) -> wp.float64:
    """Friction per newton that presses the teeth [1]."""
    return p.gear_load + at_low_speed(p, p.gear_static, speed)


@wp.func
def loaded_friction(
    p: Plant, motor: wp.float64, tension: wp.float64, bend: wp.float64, speed: wp.float64
) -> wp.float64:
    """What the gear keeps because it is loaded [N], positive against winding in."""
    backwards = wp.min(bend, ZERO)
    if tension < ZERO:
        backwards = wp.max(bend, ZERO)
    kept = (p.load * bend + p.holding * backwards) * wp.abs(tension)
    return kept + gear_load(p, speed) * wp.abs(motor + tension) * bend


@wp.func
def faded(p: Plant, weakness: wp.float64, force: wp.float64) -> wp.float64:
    """Weakness of a motor [1] after it has given a force for a step."""
    return weakness + p.fade_share * (p.fade * force * force - weakness)


@wp.func
def gear_slip(p: Plant, s: Line, pull: wp.float64) -> wp.float64:
    """Travel of an ideal source since a step ago [m], if the tendon has this tension now."""
    return s.slid + p.compliance * (pull - s.tension)


@wp.func
def given(p: Plant, s: Line, command: wp.float64, pull: wp.float64) -> wp.float64:
    """Tension that an ideal source gives [N] through a gear and a tendon that carry this one."""
    stretching = p.compliance * (pull - s.tension) / p.step
    rate = (s.speed + s.mount_speed + stretching) / p.radius
    motor = motor_force(p, s, command, source_angle(p, s, command, pull), rate)
    motor = lagging(p, s, motor)
    bend = bend_after(p, s.gear, gear_slip(p, s, pull), p.bristle)
    left = motor - viscous_friction(p, rate) - dry_friction(p, s, s.speed) * bend
    left -= p.dahl * bend_after(p, s.dahl, gear_slip(p, s, pull), p.dahl_travel)
    sense = wp.sign(left)
    backwards = wp.min(bend * sense, ZERO)
    toothed = gear_load(p, s.speed)
    drawn = ONE + (p.load + toothed) * bend * sense + p.holding * backwards
    return (left - toothed * bend * sense * motor) / drawn


@wp.func
def source_angle(p: Plant, s: Line, command: wp.float64, pull: wp.float64) -> wp.float64:
    """Angle of an ideal source [rad]: within its play it is where its command is."""
    taut = taut_angle(p, s, pull)
    return wp.clamp(command, taut - HALF * p.backlash, taut + HALF * p.backlash)
