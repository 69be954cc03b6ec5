"""The plant's equations of motion: one kernel, a thread per recording, all of it in one launch.

Leapfrog: positions at whole steps, velocities at half steps; what depends on velocity sees it
extrapolated by half a step, and the command is averaged over the interval of each kick, so that
jumps and delays fall between steps exactly. Of second order, explicit, double precision.
"""

import warp as wp

ZERO = wp.constant(wp.float64(0.0))
HALF = wp.constant(wp.float64(0.5))
ONE = wp.constant(wp.float64(1.0))
TWO = wp.constant(wp.float64(2.0))
PI = wp.constant(wp.float64(3.141592653589793))
SIMULTANEOUS = wp.constant(wp.float64(1.0e-6))  # [steps] rounding of delay / step
CURVATURE_SPEED = wp.constant(wp.float64(20.0))  # [rad/s] where viscous_curvature is the excess


@wp.struct
class Plant:
    """One bench with its causes, as the kernel reads it; units as in ``bench.py``."""

    joints: wp.int32
    mass: wp.vec2d
    length: wp.vec2d
    stiffness: wp.vec2d
    damping: wp.vec2d
    upper: wp.vec2d
    stop_stiffness: wp.vec2d
    stop_damping: wp.vec2d
    arm: wp.vec2d
    start: wp.vec2d
    radius: wp.float64
    gain: wp.float64
    limit: wp.float64
    gravity: wp.float64
    bristle: wp.float64
    delay: wp.float64
    offset: wp.float64
    viscous: wp.float64
    curvature: wp.float64
    coulomb: wp.float64
    load: wp.float64
    cogging: wp.float64
    cogging_rate: wp.float64
    cogging_phase: wp.float64


@wp.func
def tension(
    p: Plant, command: wp.float64, angle: wp.float64, speed: wp.float64, bend: wp.float64
) -> wp.float64:
    """Tension at the load cell [N]: limited motor force less friction, never a push.

    Load-dependent friction is ``load * tension * bend``, so the tension stands on both sides.
    """
    motor = p.gain * (command - angle)
    motor += p.cogging * wp.sin(p.cogging_rate * angle + p.cogging_phase)
    motor = wp.clamp(motor, -p.limit, p.limit)
    viscous = p.viscous * speed * (ONE + p.curvature * wp.abs(speed) / CURVATURE_SPEED)
    return wp.max(ZERO, (motor - viscous - p.coulomb * bend) / (ONE + p.load * bend))


@wp.func
def stop(p: Plant, i: wp.int32, q: wp.float64, v: wp.float64) -> wp.float64:
    """Force of joint i's end stops, positive opens the range: one-sided, they never pull."""
    force = ZERO
    if q < ZERO:
        force = wp.max(ZERO, -p.stop_stiffness[i] * q - p.stop_damping[i] * v)
    over = q - p.upper[i]
    if over > ZERO:
        force = -wp.max(ZERO, p.stop_stiffness[i] * over + p.stop_damping[i] * v)
    return force


@wp.func
def passive(p: Plant, i: wp.int32, q: wp.float64, v: wp.float64) -> wp.float64:
    """Spring, damper and end stops of joint i."""
    return stop(p, i, q, v) - p.stiffness[i] * q - p.damping[i] * v


@wp.func
def finger_acceleration(p: Plant, q: wp.vec2d, v: wp.vec2d, pull: wp.float64) -> wp.vec2d:
    """Two links in a vertical plane, pulled by one tendon: M a = tau - C - G in closed form."""
    cos_pip = wp.cos(q[0])
    cos_dip = wp.cos(q[1])
    sin_dip = wp.sin(q[1])
    cos_tip = cos_pip * cos_dip - wp.sin(q[0]) * sin_dip
    first = HALF * p.length[0]
    second = HALF * p.length[1]
    inertia_pip = p.mass[0] * p.length[0] * p.length[0] / wp.float64(12.0)
    inertia_dip = p.mass[1] * p.length[1] * p.length[1] / wp.float64(12.0)
    couple = p.mass[1] * p.length[0] * second
    m_dd = inertia_dip + p.mass[1] * second * second
    m_pd = m_dd + couple * cos_dip
    m_pp = inertia_pip + p.mass[0] * first * first + m_dd
    m_pp += p.mass[1] * p.length[0] * p.length[0] + TWO * couple * cos_dip
    swing = couple * sin_dip
    weight_dip = p.gravity * p.mass[1] * second * cos_tip
    weight_pip = p.gravity * (p.mass[0] * first + p.mass[1] * p.length[0]) * cos_pip + weight_dip
    tau_pip = p.arm[0] * pull + passive(p, 0, q[0], v[0]) + weight_pip
    tau_pip += swing * v[1] * (TWO * v[0] + v[1])
    tau_dip = p.arm[1] * pull + passive(p, 1, q[1], v[1]) + weight_dip
    tau_dip -= swing * v[0] * v[0]
    scale = ONE / (m_pp * m_dd - m_pd * m_pd)
    return wp.vec2d(
        (m_dd * tau_pip - m_pd * tau_dip) * scale, (m_pp * tau_dip - m_pd * tau_pip) * scale
    )


@wp.func
def acceleration(p: Plant, q: wp.vec2d, v: wp.vec2d, pull: wp.float64) -> wp.vec2d:
    """Acceleration of the bench's coordinates under a pull [N] along the tendon."""
    if p.joints == 2:
        return finger_acceleration(p, q, v, pull)
    return wp.vec2d((p.arm[0] * pull + passive(p, 0, q[0], v[0])) / p.mass[0], ZERO)


@wp.func
def bend_after(p: Plant, bend: wp.float64, slip: wp.float64) -> wp.float64:
    """Bristles' bend as a share of its greatest, after a slip [m]: Dahl's law, integrated."""
    if slip == ZERO or (p.coulomb == ZERO and p.load == ZERO):
        return bend
    towards = wp.sign(slip)
    return towards + (bend - towards) * wp.exp(-wp.abs(slip) / p.bristle)


@wp.kernel(enable_backward=False)
def drive(
    plants: wp.array[Plant],
    counts: wp.array[wp.int32],
    rows: wp.array2d[wp.int32],
    command: wp.array2d[wp.float64],
    knock_counts: wp.array[wp.int32],
    knocks: wp.array2d[wp.vec3d],
    step: wp.float64,
    coordinates: wp.array2d[wp.vec2d],
    speed: wp.array2d[wp.float64],
    force: wp.array2d[wp.float64],
) -> None:
    """Run recording i from rest; ``rows`` are whole steps, knocks are (start, width, peak)."""
    i = wp.tid()
    p = plants[i]
    late = p.delay / step
    q = p.start
    half_v = wp.vec2d(ZERO, ZERO)
    a = wp.vec2d(ZERO, ZERO)
    bend = wp.float64(0.0)
    row = wp.int32(0)
    held = wp.int32(0)  # the row whose command holds when the kick begins
    knock = wp.int32(0)
    for n in range(rows[i, counts[i] - 1] + 1):
        v = half_v + HALF * step * a
        angle = wp.dot(p.arm, q) / p.radius + p.offset
        rate = wp.dot(p.arm, v) / p.radius
        now = wp.float64(n) - late
        mean = command[i, held]
        just = mean
        if held + 1 < counts[i]:
            boundary = wp.float64(rows[i, held + 1])
            following = command[i, held + 1]
            if boundary <= now + SIMULTANEOUS:
                just = following
            if boundary < now + HALF:
                mean += (following - mean) * (now + HALF - boundary)
                held += 1
        if n == rows[i, row]:
            coordinates[i, row] = q
            speed[i, row] = rate
            force[i, row] = tension(p, just, angle, rate, bend)
            row += 1
        pull = tension(p, mean, angle, rate, bend)
        if knock < knock_counts[i]:
            k = knocks[i, knock]
            phase = (wp.float64(n) * step - k[0]) / k[1]
            if phase > ZERO and phase < ONE:
                pull += k[2] * wp.sin(PI * phase)
            if phase >= ONE:
                knock += 1
        a = acceleration(p, q, v, pull)
        half_v = half_v + step * a
        moved = step * half_v
        q = q + moved
        bend = bend_after(p, bend, wp.dot(p.arm, moved))
