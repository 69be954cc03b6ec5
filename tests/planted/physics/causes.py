"""The causes that can be hidden in the plant: one number each, or a few."""

from dataclasses import dataclass

KNEE, ROUND_KNEE = 0.05, 0.15
"""Width of a saturation's knee against its limit, in the plant's two forms [1]."""


@dataclass(frozen=True, kw_only=True)
class Causes:
    """What makes the plant differ from its nominal self; the defaults hide nothing."""

    # Other laws of bristles, knees and contacts than the plant's first ones
    second_form: bool = False

    gain_scale: float = 1.0  # Force per radian against nominal [1]
    gain_drift: float = 0.0  # Share of the gain lost per second [1/s]
    delay: float = 0.0  # Age of the command that the servo acts on [s]
    lag: float = 0.0  # Time constant of the motor force [s]
    # Error below which the motor does nothing [rad]; the error beyond counts from there
    deadband: float = 0.0
    saturation: float = 0.0  # Greatest motor force, either way [N]; 0 is the servo's own limit
    speed_limit: float = 0.0  # Greatest speed of the motor, either way [rad/s]; 0 is none
    # Greatest speed of the goal that the servo makes of its command [rad/s]; 0 is none
    goal_rate: float = 0.0
    goal_acceleration: float = 0.0  # Its greatest acceleration [rad/s^2]; 0 is none
    starting_duty: float = 0.0  # Share of all it has that the servo gives on top of any demand [1]
    overload: float = 1.0  # Share of all it has beyond which the servo is overloaded [1]
    protective: float = 1.0  # Share that it gives while it protects itself [1]
    protection_time: float = 0.0  # Time of overload after which it does [s]; 0 is never
    viscous: float = 0.0  # Viscous friction of the motor [N s/rad]
    viscous_curvature: float = 0.0  # Share by which the viscous friction has grown at 20 rad/s [1]
    coulomb: float = 0.0  # Force at which the motor's bristles give way [N]
    winding: float = 0.0  # What that is more while the string is wound in [N]
    unwinding: float = 0.0  # The same while it is paid out [N]
    dahl: float = 0.0  # Force of further bristles, softer than those of the gear [N]
    dahl_travel: float = 1e-3  # Travel over which it builds up to 63 % [m]
    static: float = 0.0  # What they hold beyond that at rest [N]
    stribeck_speed: float = 1.0  # Motor speed at which this has fallen to 37 % [rad/s]
    load: float = 0.0  # Force at which they give way per newton of tendon tension [1]
    holding: float = 0.0  # The same, but only while the load turns the gear backwards [1]
    # The same per newton that presses the teeth, of motor and load together [1]
    gear_load: float = 0.0
    # What that is more at rest; it falls with speed as ``static`` does [1]
    gear_static: float = 0.0
    # Travel over which friction builds up to 63 % [m]; to 95 % over three times that
    bristle: float = 7e-6
    sag: float = 0.0  # Share by which the supply gives way per newton of motor force [1/N]
    fade: float = 0.0  # Weakness that a motor force builds up, per its square [1/N^2]
    fade_time: float = 1.0  # Time in which it does [s]
    # Angle through which the shaft turns without touching what it drives [rad]
    backlash: float = 0.0

    slack: float = 0.0  # Loose tendon between spool and mechanism [m]
    compliance: float = 0.0  # Stretch of the tendon [m/N]
    routing: float = 0.0  # Logarithm of the tension's loss along the guides [1]
    # Travel of the string in its guides over which that builds up to 63 % [m]
    guide_bristle: float = 7e-6
    radius_scale: float = 1.0  # Spool radius against nominal [1]

    stiffness_scale: float = 1.0  # Return springs against nominal [1]
    damping_scale: float = 1.0  # Joint damping against nominal [1]
    inertia_scale: float = 1.0  # Resistance of the masses to acceleration [1]; their weight stays
    # Dry friction of each joint as a share of its spring's torque at the end of the range [1]
    joint_friction: float = 0.0
    stiffening: float = 0.0  # Share by which the springs are stiffer at the end of the range [1]
    # Stiffness of a spring in series with a damper beside each return spring, against it [1]
    maxwell_ratio: float = 0.0
    relaxation: float = 1.0  # Time in which that pair relaxes [s]
    obstruction: float = 0.0  # Stiffness of a contact that the tendon's end runs into [N/m]
    obstruction_at: float = 0.0  # Excursion at which it does, over the nominal spool radius [rad]
    tilt: float = 0.0  # Rotation of the bench about +y: finger and rail point downward [rad]

    # Encoder's zero against the mechanism's [rad]: measured angle = l / r + offset
    offset: float = 0.0
    cell_bias: float = 0.0  # [N]
    cell_gain: float = 1.0  # [1]
    cell_drift: float = 0.0  # [N/s] from each recording's first row
    cell_lag: float = 0.0  # Time constant of the load cell [s]
    cell_delay: float = 0.0  # How late the load cell's clock is [s]
    joint_gain: float = 1.0  # What encoders on joints read of their motion [1]
    joint_delay: float = 0.0  # How late these encoders are [s]
    tip_gain: float = 1.0  # How far the tip is seen to move against how far it does [1]
    tip_delay: float = 0.0  # How late it is seen [s]
    current_gain: float = 1.0  # What is read of the motor's current [1]
    current_delay: float = 0.0  # How late it is read [s]
    supply_sag: float = 0.0  # Share by which the supply is read too low per newton [1/N]
    period_scale: float = 1.0  # Time between two rows against what the log says [1]

    # Amplitude of the motor force's ripple [N], in sin(cogging_rate * angle + phase)
    cogging: float = 0.0
    # Phase of the ripple per radian of the motor [1]: 8 means eight ripples a turn
    cogging_rate: float = 8.0
    cogging_phase: float = 0.0  # [rad]
    command_step: float = 0.0  # Resolution of the command inside the servo [rad]; 0 is exact
    dead_spot: float = 0.0  # Share of the motor force lost around one angle [1]
    dead_spot_at: float = 0.0  # That angle [rad]
    dead_spot_width: float = 0.1  # Distance from it at which the loss has fallen to 37 % [rad]
    mount_compliance: float = 0.0  # Give of the servo's mount at rest [m/N]
    # Angular frequency at which servo and mount swing [rad/s]; damped to a tenth
    mount_rate: float = 20.0
    knock_rate: float = 0.0  # Hands in the way [1/s]
    knock_peak: float = 0.0  # Their typical force [N]
    # Standard deviation of a gain that wanders about its mean within two seconds [1]
    gain_wander: float = 0.0
    # Dry friction that comes and goes within five seconds, at its most [N]
    friction_sway: float = 0.0
    jitter: float = 0.0  # Greatest extra age of a command, drawn anew for each [s]
    stuck_rate: float = 0.0  # Stretches in which the logged encoder repeats itself [1/s]

    mass_scale: float = 1.0  # Unlisted imperfection of the masses [1]
    damper_scale: float = 1.0  # Unlisted imperfection of the joint damping [1]

    @property
    def knee(self) -> float:
        """Width of a saturation's knee, against its limit [1]."""
        return ROUND_KNEE if self.second_form else KNEE
