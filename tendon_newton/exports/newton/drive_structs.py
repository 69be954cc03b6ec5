"""What a drive remembers, knows and answers, as Warp keeps it."""

from __future__ import annotations

from tendon_newton.device_code.placeholders import MemoryVector, real
from tendon_newton.device_code.templates import device_struct


@device_struct
class Kept:
    """What a drive remembers of one tendon."""

    memory: MemoryVector  # What the effects remember
    bend: real  # How far dry friction has bent [m]
    joint_bend: real  # How far dry friction has bent the joint [rad, m]
    outrun: real  # How far the tendon has outrun its motor [m]
    share: real  # Where the tendon is between sliding in (0) and out (1)
    pull: real  # Pull on the mechanism one step ago [N]
    wound: real  # String on the spool [m]
    wound_rate: real  # Rate of the wound string [m/s]
    speed: real  # Rate of the wound string one step ago [m/s]
    command: real  # Desired motor angle one step ago [rad]
    time: real  # Time since the reset [s]
    count: int  # Steps since the reset


@device_struct
class DriveBench:
    """Numbers of one tendon that its drive needs besides the model's."""

    inertia: real  # Inertia of the mechanism, as felt at the string [kg]
    rotor: real  # Inertia of the motor's rotor, as felt at the string [kg]
    joint_inertia: real  # Inertia of the mechanism, as felt at the joint [kg m2, kg]
    step: real  # [s]


@device_struct
class DriveAnswer:
    """What a drive gives and reports."""

    kept: Kept
    pull: real  # On the mechanism [N]
    tension: real  # At the load cell [N]
    tension_gain: real  # Share of a rotor's inertia that the load cell feels [1]
    pull_gain: real  # Share of the tension that the mechanism feels [1]
    spool_change: real  # How the rotor of a string accelerates [m/s2]
    angle: real  # What the encoder reports [rad]
    rate: real  # [rad/s]


@device_struct
class Way:
    """The way of one tendon: l = sum over terms of a number times powers of the joints."""

    terms: int  # How many there are
    inertia: real  # Inertia of the mechanism, as felt at the string [kg]
    rotor: real  # Inertia of the motor's rotor, as felt at the string [kg]
    radius: real  # Radius of the spool [m]
    limit: real  # Greatest force of the servo [N]
    least: real  # Least tension [N]


@device_struct
class JointMore:
    """What a drive knows of a joint besides what effects see."""

    stiffness: real  # What the solver's own spring has [N m/rad, N/m]
    damping: real  # What its own damper has [N m s/rad, N s/m]
    stop_stiffness: real  # Stiffness of the end stops [N m/rad, N/m]
    stop_damping: real  # Damping of the end stops [N m s/rad, N s/m]
    friction: real  # Dry friction [N m, N]
    inertia: real  # Inertia of the mechanism, as felt at the joint [kg m2, kg]


@device_struct
class Report:
    """What one slot reports."""

    angle: real  # Angle of the encoder [rad]
    rate: real  # Rate of that angle [rad/s]
    tension: real  # See `DriveAnswer`, as the next three
    tension_gain: real
    pull_gain: real
    spool_change: real
    asked: real  # Angle that a force network is shown as asked for [rad]
