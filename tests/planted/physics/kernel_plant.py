"""One bench with its causes, as the plant's kernel reads it."""

import warp as wp

ZERO = wp.constant(wp.float64(0.0))
HALF = wp.constant(wp.float64(0.5))
ONE = wp.constant(wp.float64(1.0))
TWO = wp.constant(wp.float64(2.0))
PI = wp.constant(wp.float64(3.141592653589793))
AT_TRAVEL = wp.constant(wp.float64(0.632))  # share of the friction after its travel, in both forms


@wp.struct
class Plant:
    """Numbers of one recording's plant; units as in ``bench.py`` and ``causes.py``."""

    step: wp.float64
    rounded: wp.int32  # the second form of bristles, knees and contacts
    knee: wp.float64  # width of a saturation's knee, against its limit
    joints: wp.int32
    direct: wp.int32  # the shaft is the joint: it pushes as well as pulls
    mass: wp.vec2d
    length: wp.vec2d
    stiffness: wp.vec2d
    damping: wp.vec2d
    upper: wp.vec2d
    stop_stiffness: wp.vec2d
    stop_damping: wp.vec2d
    arm: wp.vec2d
    gravity: wp.float64
    tilt: wp.float64
    inertia: wp.float64
    stiffening: wp.float64
    joint_friction: wp.vec2d  # [N m], slider [N]
    joint_bristle: wp.vec2d  # [rad], slider [m]
    maxwell: wp.vec2d  # [N m/rad], slider [N/m]
    relaxation: wp.float64
    obstruction: wp.float64
    contact_damping: wp.float64  # [N s/m]
    obstruction_at: wp.float64  # [m] of excursion
    start: wp.vec2d
    start_tension: wp.float64
    radius: wp.float64
    nominal_radius: wp.float64
    offset: wp.float64
    slack: wp.float64
    compliance: wp.float64
    routing: wp.float64
    guide_bristle: wp.float64
    backlash: wp.float64
    gain: wp.float64
    gain_drift: wp.float64
    limit: wp.float64
    saturation: wp.float64  # 0 is none
    deadband: wp.float64
    lag_share: wp.float64  # of the way that the motor force goes in one step; 1 is no lag
    speed_limit: wp.float64
    goal_rate: wp.float64  # 0 is none
    goal_acceleration: wp.float64  # 0 is none
    starting_duty: wp.float64
    overload: wp.float64
    protective: wp.float64
    protection_time: wp.float64  # 0 is never
    viscous: wp.float64
    curvature: wp.float64
    coulomb: wp.float64
    winding: wp.float64
    unwinding: wp.float64
    dahl: wp.float64
    dahl_travel: wp.float64
    excess: wp.float64
    stribeck_speed: wp.float64
    load: wp.float64
    holding: wp.float64
    gear_load: wp.float64
    gear_static: wp.float64
    sag: wp.float64
    fade: wp.float64
    fade_share: wp.float64  # of the way that the weakness goes in one step
    bristle: wp.float64
    cogging: wp.float64
    cogging_rate: wp.float64
    cogging_phase: wp.float64
    dead_spot: wp.float64
    dead_spot_at: wp.float64
    dead_spot_width: wp.float64
    rotor: wp.float64  # [kg m^2]; 0 is the ideal source
    duty_per_rad: wp.float64
    greatest_duty: wp.float64
    supply: wp.float64
    torque_constant: wp.float64
    resistance: wp.float64
    string: wp.float64  # [N/m] between a rotor and the mechanism
    string_damping: wp.float64  # [N s/m]
    mount_compliance: wp.float64
    mount_rate: wp.float64
    cell_share: wp.float64  # of the way that the cell's reading goes in one step; 1 is no lag
    cell_delay: wp.float64
    disturbed: wp.int32


@wp.func
def beyond(error: wp.float64, gap: wp.float64) -> wp.float64:
    """What an error exceeds a gap by, either way."""
    return wp.sign(error) * wp.max(ZERO, wp.abs(error) - gap)


@wp.func
def bend_after(p: Plant, bend: wp.float64, slip: wp.float64, travel: wp.float64) -> wp.float64:
    """Bristles' bend as a share of its greatest, after a slip: Dahl's law, integrated.

    In the second form they bend in proportion until they slide, as Prandtl has it.
    """
    if slip == ZERO:
        return bend
    if p.rounded != 0:
        return wp.clamp(bend + AT_TRAVEL * slip / travel, -ONE, ONE)
    towards = wp.sign(slip)
    return towards + (bend - towards) * wp.exp(-wp.abs(slip) / travel)
