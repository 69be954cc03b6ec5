"""The plant's tendon: what it carries between a servo and a mechanism, and how both move on."""

import warp as wp

from tests.planted.physics.kernel_plant import HALF, ONE, TWO, ZERO, Plant, bend_after, beyond
from tests.planted.physics.kernel_servo import (
    Line,
    dry_friction,
    faded,
    gear_slip,
    given,
    lagging,
    loaded_friction,
    motor_force,
    overloaded_after,
    source_angle,
    taut_angle,
    viscous_friction,
)

MOUNT_DAMPING = wp.constant(wp.float64(0.1))  # of the critical
BRACKET = wp.constant(wp.float64(1.0e3))  # [N] that no tendon carries
# of Newton's method for a tendon that stretches, from a step ago: without and with a stuck gear
ROUNDS = wp.constant(2)
STUCK_ROUNDS = wp.constant(10)


@wp.func
def tension(p: Plant, s: Line, command: wp.float64) -> wp.float64:
    """Tension at the load cell [N]; a string cannot push.

    Behind an ideal source it is the motor's force less the gear's friction. If the tendon
    stretches it stands on both sides: in the motor's angle, its rate and the bend of its bristles.
    """
    if p.rotor > ZERO:
        return string_force(p, s)
    pull = given(p, s, command, s.tension)
    if p.compliance != ZERO:
        pull = stretched(p, s, command)
    if p.direct != 0:
        return pull
    return wp.max(ZERO, pull)


@wp.func
def stretched(p: Plant, s: Line, command: wp.float64) -> wp.float64:
    """Tension at which a tendon that stretches and an ideal source agree [N]: kept in a bracket."""
    rounds = ROUNDS
    per_newton = p.load + p.holding + TWO * (p.gear_load + p.gear_static)
    if p.coulomb + p.winding + p.unwinding + p.excess + s.dry + per_newton != ZERO:
        rounds = STUCK_ROUNDS
    share = ONE
    if p.lag_share < ONE:
        share = HALF * p.lag_share
    firm = p.compliance / p.radius * (p.gain * s.gain * share + p.viscous / p.step)
    low = ZERO
    high = BRACKET
    pull = s.tension
    for _ in range(rounds):
        off = pull - given(p, s, command, pull)
        if off > ZERO:
            high = pull
        else:
            low = pull
        slip = gear_slip(p, s, pull)
        left = ONE - wp.sign(slip) * bend_after(p, s.gear, slip, p.bristle)
        dry = dry_friction(p, s, s.speed) + per_newton * pull
        pull -= off / (ONE + firm + dry * left * p.compliance / p.bristle)
        if low == ZERO:
            pull = wp.max(ZERO, pull)
        if pull < low or pull > high:
            pull = HALF * (low + high)
    return pull


@wp.func
def string_force(p: Plant, s: Line) -> wp.float64:
    """Force of the elastic string between a rotor's spool and the mechanism [N]."""
    wound = p.radius * s.angle - s.excursion - p.slack
    play = HALF * p.backlash * p.radius
    stretch = wound - play
    if p.direct != 0:
        stretch = beyond(wound, play)
    pull = p.string * stretch + p.string_damping * (p.radius * s.rate - s.speed)
    if p.direct != 0:
        return pull * wp.abs(wp.sign(stretch))
    if stretch <= ZERO:
        return ZERO
    return wp.max(ZERO, pull)


@wp.func
def motor_angle(p: Plant, s: Line, command: wp.float64, pull: wp.float64) -> wp.float64:
    """Motor angle [rad]; an ideal source on a loose tendon is where its command is."""
    if p.rotor > ZERO:
        return s.angle + p.offset
    angle = source_angle(p, s, command, pull)
    if pull > ZERO or p.slack == ZERO:
        return angle
    taut = taut_angle(p, s, pull)
    return wp.clamp(command, taut - p.slack / p.radius, taut)


@wp.func
def motor_pull(p: Plant, s: Line, command: wp.float64, pull: wp.float64) -> wp.float64:
    """Force that the motor gives just now [N], under a tension."""
    angle = s.angle + p.offset
    if p.rotor == ZERO:
        angle = source_angle(p, s, command, pull)
    return lagging(p, s, motor_force(p, s, command, angle, s.rate))


@wp.func
def moved_rotor(p: Plant, before: Line, command: wp.float64, pull: wp.float64) -> Line:
    """Rotor and gear a step later, against a tension [N]."""
    s = before
    motor = lagging(p, s, motor_force(p, s, command, s.angle + p.offset, s.rate))
    kept = viscous_friction(p, s.rate) + dry_friction(p, s, p.radius * s.rate) * s.gear
    kept += p.dahl * s.dahl
    kept += loaded_friction(p, motor, pull, s.gear, p.radius * s.rate)
    s.turning = (motor - kept - pull) * p.radius / p.rotor
    s.half_rate += p.step * s.turning
    s.angle += p.step * s.half_rate
    s.gear = bend_after(p, s.gear, p.step * p.radius * s.half_rate, p.bristle)
    s.dahl = bend_after(p, s.dahl, p.step * p.radius * s.half_rate, p.dahl_travel)
    return s


@wp.func
def line_after(
    p: Plant, before: Line, command: wp.float64, pull: wp.float64, slip: wp.float64
) -> Line:
    """State of servo and tendon a step later, in which the tendon slips that far [m]."""
    s = before
    angle = s.angle + p.offset
    rate = s.rate
    if p.rotor == ZERO:
        angle = source_angle(p, s, command, pull)
        rate = s.speed / p.radius
    target = motor_force(p, s, command, angle, rate)
    if p.protection_time > ZERO:
        s.overloaded = overloaded_after(p, s, command - angle)
    if p.rotor > ZERO:
        s = moved_rotor(p, before, command, pull)
    else:
        s.dahl = bend_after(p, s.dahl, gear_slip(p, s, pull), p.dahl_travel)
        s.gear = bend_after(p, s.gear, gear_slip(p, s, pull), p.bristle)
        s.slid = slip + p.step * s.mount_speed
    if p.lag_share < ONE:
        s.motor += p.lag_share * (target - s.motor)
    if p.fade != ZERO:
        s.weakness = faded(p, s.weakness, target)
    s.tension = pull
    s.guide = bend_after(p, s.guide, slip, p.guide_bristle)
    if p.mount_compliance != ZERO:
        spring = p.mount_rate * p.mount_rate * (p.mount_compliance * pull - s.mount)
        damper = TWO * MOUNT_DAMPING * p.mount_rate * s.mount_speed
        s.mount_speed += p.step * (spring - damper)
        s.mount += p.step * s.mount_speed
    return s


@wp.func
def first_line(p: Plant, command: wp.float64) -> Line:
    """Servo and tendon at rest under the first command."""
    s = Line()
    s.excursion = wp.dot(p.arm, p.start)
    s.tension = p.start_tension
    s.mount = p.mount_compliance * p.start_tension
    s.gain = ONE
    s.goal = command
    s.weakness = p.fade * p.start_tension * p.start_tension
    play = HALF * p.backlash * wp.sign(p.start_tension)
    s.angle = (s.excursion + p.slack) / p.radius + play
    angle = source_angle(p, s, command, s.tension)
    if p.rotor > ZERO:
        s.angle += p.start_tension / (p.string * p.radius)
        angle = s.angle + p.offset
    s.motor = motor_force(p, s, command, angle, ZERO)
    return s
