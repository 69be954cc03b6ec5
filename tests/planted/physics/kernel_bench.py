"""Equations of motion of the plant's benches: two links in a plane, a slider, a pendulum."""

import warp as wp

from tests.planted.physics.kernel_plant import HALF, ONE, TWO, ZERO, Plant

DEPTH = wp.constant(wp.float64(1.0e-3))  # [m] at which both forms of a contact damp alike


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
    reach = q / p.upper[i]
    spring = p.stiffness[i] * q * (ONE + p.stiffening * reach * reach)
    return stop(p, i, q, v) - spring - p.damping[i] * v


@wp.func
def finger_acceleration(
    p: Plant, q: wp.vec2d, v: wp.vec2d, pull: wp.float64, held: wp.vec2d
) -> wp.vec2d:
    """Two links pulled by one tendon: M a = tau - C - G in closed form."""
    cos_pip = wp.cos(q[0] + p.tilt)
    cos_dip = wp.cos(q[1])
    sin_dip = wp.sin(q[1])
    cos_tip = cos_pip * cos_dip - wp.sin(q[0] + p.tilt) * sin_dip
    first = HALF * p.length[0]
    second = HALF * p.length[1]
    inertia_pip = p.mass[0] * p.length[0] * p.length[0] / wp.float64(12.0)
    inertia_dip = p.mass[1] * p.length[1] * p.length[1] / wp.float64(12.0)
    couple = p.mass[1] * p.length[0] * second
    m_dd = inertia_dip + p.mass[1] * second * second
    m_pd = m_dd + couple * cos_dip
    m_pp = inertia_pip + p.mass[0] * first * first + m_dd
    m_pp += p.mass[1] * p.length[0] * p.length[0] + TWO * couple * cos_dip
    swing = p.inertia * couple * sin_dip
    weight_dip = p.gravity * p.mass[1] * second * cos_tip
    weight_pip = p.gravity * (p.mass[0] * first + p.mass[1] * p.length[0]) * cos_pip + weight_dip
    tau_pip = p.arm[0] * pull + passive(p, 0, q[0], v[0]) - held[0] + weight_pip
    tau_pip += swing * v[1] * (TWO * v[0] + v[1])
    tau_dip = p.arm[1] * pull + passive(p, 1, q[1], v[1]) - held[1] + weight_dip
    tau_dip -= swing * v[0] * v[0]
    scale = ONE / (p.inertia * (m_pp * m_dd - m_pd * m_pd))
    return wp.vec2d(
        (m_dd * tau_pip - m_pd * tau_dip) * scale, (m_pp * tau_dip - m_pd * tau_pip) * scale
    )


@wp.func
def acceleration(p: Plant, q: wp.vec2d, v: wp.vec2d, pull: wp.float64, held: wp.vec2d) -> wp.vec2d:
    """Acceleration of the bench's coordinates under a pull [N] along the tendon.

    ``held`` is what relaxing springs and the joints' bristles hold back [N m], slider [N].
    """
    if p.joints == 2:
        return finger_acceleration(p, q, v, pull, held)
    force = p.arm[0] * pull + passive(p, 0, q[0], v[0]) - held[0]
    inertia = p.inertia * p.mass[0]
    if p.direct != 0:
        force -= p.mass[0] * p.gravity * p.length[0] * wp.sin(q[0] + p.tilt)
        inertia *= p.length[0] * p.length[0]
    else:
        force += p.mass[0] * p.gravity * wp.sin(p.tilt)
    return wp.vec2d(force / inertia, ZERO)


@wp.func
def contact(p: Plant, excursion: wp.float64, speed: wp.float64) -> wp.float64:
    """Force of the obstruction against the tendon's end [N]; it never pulls."""
    depth = excursion - p.obstruction_at
    if p.obstruction == ZERO or depth <= ZERO:
        return ZERO
    damping = p.contact_damping
    if p.rounded != 0:
        damping *= depth / DEPTH  # as Hunt and Crossley have it
    return wp.max(ZERO, p.obstruction * depth + damping * speed)


@wp.func
def relaxed(p: Plant, i: wp.int32, force: wp.float64, moved: wp.float64) -> wp.float64:
    """Force of joint i's relaxing spring a step later, after an even motion in between."""
    if p.maxwell[i] == ZERO:
        return ZERO
    steps = p.step / p.relaxation
    kept = wp.exp(-steps)
    return force * kept + p.maxwell[i] * moved * (ONE - kept) / steps
