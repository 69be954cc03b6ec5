"""The plant's run: one kernel, a thread per recording, all of it in one launch.

Leapfrog: positions at whole steps, velocities at half steps; what depends on velocity sees it
extrapolated by half a step, and the command is averaged over the interval of each kick, so that
jumps and delays fall between steps exactly. Of second order, explicit, double precision.
"""

import warp as wp

from tests.planted.physics.kernel_bench import acceleration, contact, relaxed
from tests.planted.physics.kernel_line import (
    first_line,
    line_after,
    motor_angle,
    motor_pull,
    tension,
)
from tests.planted.physics.kernel_plant import HALF, ONE, PI, ZERO, Plant, bend_after
from tests.planted.physics.kernel_servo import Line, goal_after

SIMULTANEOUS = wp.constant(wp.float64(1.0e-6))  # [steps] rounding of delay / step


@wp.func
def within_speed(
    p: Plant,
    s: Line,
    q: wp.vec2d,
    v: wp.vec2d,
    half_v: wp.vec2d,
    held: wp.vec2d,
    elsewhere: wp.float64,
    share: wp.float64,
    pull: wp.float64,
) -> wp.float64:
    """Tension with which the tendon's next speed stays within the motor's [N]."""
    free = acceleration(p, q, v, elsewhere, held)
    pulled = acceleration(p, q, v, elsewhere + share, held) - free
    coasting = wp.dot(p.arm, half_v + p.step * free)
    per_newton = p.step * wp.dot(p.arm, pulled)
    most = p.speed_limit * p.radius
    return wp.max(
        ZERO, wp.clamp(pull, (-most - coasting) / per_newton, (most - coasting) / per_newton)
    )


@wp.func
def knock_force(knock: wp.vec3d, now: wp.float64) -> wp.float64:
    """Force of a hand (start, width, peak) on the tendon's end [N]."""
    phase = (now - knock[0]) / knock[1]
    if phase > ZERO and phase < ONE:
        return knock[2] * wp.sin(PI * phase)
    return ZERO


@wp.func
def cell_is_due(
    rows: wp.array2d[wp.int32], i: wp.int32, row: wp.int32, count: wp.int32, now: wp.float64
) -> wp.bool:
    """Whether a row of the load cell lies before an instant [steps] on its own clock."""
    if row >= count:
        return False
    return wp.float64(rows[i, row]) < now


@wp.func
def heard(
    due: wp.array2d[wp.float64],
    command: wp.array2d[wp.float64],
    i: wp.int32,
    row: wp.int32,
    count: wp.int32,
    now: wp.float64,
) -> tuple[wp.float64, wp.float64, wp.int32]:
    """Command meant by the kick about this instant, command just now, rows gone on to [rad]."""
    mean = command[i, row]
    just = mean
    jumps = wp.int32(0)
    if row + 1 < count:
        boundary = due[i, row + 1]
        following = command[i, row + 1]
        if boundary <= now + SIMULTANEOUS:
            just = following
        if boundary < now + HALF:
            mean += (following - mean) * wp.min(ONE, now + HALF - boundary)
            jumps = wp.int32(1)
    return mean, just, jumps


@wp.func
def level_at(
    rows: wp.array2d[wp.int32],
    table: wp.array2d[wp.vec2d],
    i: wp.int32,
    row: wp.int32,
    now: wp.float64,
) -> wp.vec2d:
    """Level of a disturbance on the straight line up to this row."""
    before = wp.max(row - 1, 0)
    span = wp.float64(wp.max(rows[i, row] - rows[i, before], 1))
    way = (now - wp.float64(rows[i, before])) / span
    return table[i, before] * (ONE - way) + table[i, row] * way


@wp.kernel(enable_backward=False)
def drive(
    plants: wp.array[Plant],
    counts: wp.array[wp.int32],
    rows: wp.array2d[wp.int32],
    due: wp.array2d[wp.float64],
    command: wp.array2d[wp.float64],
    disturbance: wp.array2d[wp.vec2d],
    knock_counts: wp.array[wp.int32],
    knocks: wp.array2d[wp.vec3d],
    coordinates: wp.array2d[wp.vec2d],
    motor: wp.array2d[wp.vec2d],
    force: wp.array2d[wp.float64],
    cell: wp.array2d[wp.float64],
    given: wp.array2d[wp.float64],
) -> None:
    """Run recording i from rest.

    ``rows`` are whole steps, ``due`` the steps at which each row's command takes effect,
    ``disturbance`` is (gain, further friction), ``motor`` (angle, speed).
    """
    i = wp.tid()
    p = plants[i]
    count = counts[i]
    q = p.start
    half_v = wp.vec2d(ZERO, ZERO)
    a = wp.vec2d(ZERO, ZERO)
    branch = wp.vec2d(ZERO, ZERO)  # force of the relaxing springs
    bent = wp.vec2d(ZERO, ZERO)  # bristles of the joints
    s = first_line(p, command[i, 0])
    reading = s.tension  # of a lagging load cell, half a step ago
    stretching = ZERO  # [N/s] of the tension, jumps aside
    row = wp.int32(0)
    late_row = wp.int32(0)  # the row whose force the cell reads next
    held_row = wp.int32(0)  # the row whose command holds when the kick begins
    knock = wp.int32(0)
    for n in range(rows[i, count - 1] + 1):
        now = wp.float64(n)
        v = half_v + HALF * p.step * a
        s.excursion = wp.dot(p.arm, q)
        s.speed = wp.dot(p.arm, v)
        mean, just, jumps = heard(due, command, i, held_row, count, now)
        held_row += jumps
        if p.goal_rate + p.goal_acceleration > ZERO:
            just = s.goal
            s = goal_after(p, s, mean)
            mean = HALF * (just + s.goal)
        s.rate = s.half_rate + HALF * p.step * s.turning
        s.gain = ONE - p.gain_drift * now * p.step
        if p.disturbed != 0:
            level = level_at(rows, disturbance, i, wp.min(row, count - 1), now)
            s.gain *= level[0]
            s.dry = level[1]
        held = branch + wp.cw_mul(p.joint_friction, bent)
        elsewhere = -contact(p, s.excursion, s.speed)
        if knock < knock_counts[i]:
            elsewhere += knock_force(knocks[i, knock], now * p.step)
            if now * p.step >= knocks[i, knock][0] + knocks[i, knock][1]:
                knock += 1
        share = ONE
        if p.routing != ZERO:
            share = wp.exp(-p.routing * s.guide)
        pull = tension(p, s, mean)
        if p.speed_limit > ZERO:
            pull = within_speed(p, s, q, v, half_v, held, elsewhere, share, pull)
        due_now = wp.bool(n == rows[i, row])
        late_now = cell_is_due(rows, i, late_row, count, now + HALF + p.cell_delay)
        shown = pull
        if due_now or late_now:
            shown = tension(p, s, just)
            if p.speed_limit > ZERO:
                shown = within_speed(p, s, q, v, half_v, held, elsewhere, share, shown)
        next_reading = reading + p.cell_share * (pull - reading)
        while late_now:
            cell[i, late_row] = shown
            if p.cell_share < ONE:
                cell[i, late_row] = HALF * (reading + next_reading)
            late_row += 1
            late_now = cell_is_due(rows, i, late_row, count, now + HALF + p.cell_delay)
        reading = next_reading
        if due_now:
            angle = motor_angle(p, s, just, shown)
            rate = (s.speed + s.mount_speed + p.compliance * stretching) / p.radius
            if p.rotor > ZERO:
                rate = s.rate
            elif angle == just and p.slack + p.backlash != ZERO:
                rate = ZERO  # loose, and where its command is
            coordinates[i, row] = q
            motor[i, row] = wp.vec2d(angle, rate)
            force[i, row] = shown
            given[i, row] = motor_pull(p, s, just, shown)
            row += 1
        if p.compliance != ZERO and jumps == 0:
            stretching = (pull - s.tension) / p.step
        a = acceleration(p, q, v, share * pull + elsewhere, held)
        half_v = half_v + p.step * a
        moved = p.step * half_v
        q = q + moved
        s = line_after(p, s, mean, pull, wp.dot(p.arm, moved))
        if p.joint_friction[0] != ZERO:
            bent = wp.vec2d(
                bend_after(p, bent[0], moved[0], p.joint_bristle[0]),
                bend_after(p, bent[1], moved[1], p.joint_bristle[1]),
            )
        if p.relaxation > ZERO:
            branch = wp.vec2d(
                relaxed(p, 0, branch[0], moved[0]), relaxed(p, 1, branch[1], moved[1])
            )
