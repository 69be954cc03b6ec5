"""What a drive remembers, knows and answers, as Warp keeps it."""

from __future__ import annotations

from tendon_newton.device_code.placeholders import MemoryVector, real
from tendon_newton.device_code.templates import device_struct


@device_struct
class Kept:
    """What a drive remembers of one tendon."""

    memory: MemoryVector
    """Of the effects."""
    bend: real
    """How far dry friction has bent [m]."""
    joint_bend: real
    """The same of the joint [rad, m]."""
    outrun: real
    """How far the tendon has outrun its motor [m]."""
    share: real
    """Where the tendon is between sliding in (0) and out (1)."""
    pull: real
    """On the mechanism one step ago [N]."""
    wound: real
    """String on the spool [m]."""
    wound_rate: real
    """Its rate [m/s]."""
    speed: real
    """Rate of the wound string one step ago [m/s]."""
    command: real
    """Desired motor angle one step ago [rad]."""
    time: real
    """Since the reset [s]."""
    count: int
    """Steps since the reset."""


@device_struct
class Bench:
    """Numbers of one tendon that its drive needs besides the model's."""

    inertia: real
    """Of the mechanism, as felt at the string [kg]."""
    rotor: real
    """Of the motor's rotor, as felt at the string [kg]."""
    joint_inertia: real
    """Of the mechanism, as felt at the joint [kg m2, kg]."""
    step: real
    """[s]."""


@device_struct
class Answer:
    """What a drive gives and reports."""

    kept: Kept
    pull: real
    """On the mechanism [N]."""
    tension: real
    """At the load cell [N]."""
    tension_gain: real
    """Share of a rotor's inertia that the load cell feels [1]."""
    pull_gain: real
    """Share of the tension that the mechanism feels [1]."""
    spool_change: real
    """How the rotor of a string accelerates [m/s2]."""
    angle: real
    """What the encoder reports [rad]."""
    rate: real
    """[rad/s]."""
