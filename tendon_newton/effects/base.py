"""Declaration of a physical effect: parameters with nulls, equation, source, and stages."""

from collections.abc import Callable, Container
from enum import Enum
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from tendon_newton.data.parameters import Parameter
from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import Jet, Values, real
from tendon_newton.device_code.structs import Joint, Tendon
from tendon_newton.device_code.templates import DeviceCode

__all__ = ["Effect", "Jet", "Joint", "Parameter", "Stage", "Tendon", "Values", "earlier", "real"]


class Stage(Enum):
    """Where an effect acts, in the order of the signal; the effect has a device function so named.

    `values` are the effect's own parameters in the order of its declaration; `values[3]` is what it
    remembers, `values[4]` the second of two such numbers. A `Jet` is a signal with its derivatives
    by position and by velocity, so that sums, differences and multiples of jets carry the
    derivatives along.
    """

    PERIOD = "period"
    """(scale: real, values) -> real: seconds that pass in one second of the log's clock [1]."""
    CLOCK = "clock"
    """(time: real, values) -> real: the instant [s] at which the servo reads the command."""
    RADIUS = "radius"
    """(radius: real, values) -> real: the spool's radius [m]."""
    STRING = "string"
    """(stiffness: real, values) -> real: the string's stiffness [N/m], where its spool has a
    coordinate of its own."""
    STRETCH = "stretch"
    """(length: Jet, tendon, values) -> Jet: tendon wound on the spool [m]."""
    ANGLE = "angle"
    """(angle: Jet, tendon, values) -> Jet: the motor angle [rad] that the servo acts on."""
    ERROR = "error"
    """(error: Jet, tendon, values) -> Jet: the position error [rad] that the servo acts on."""
    DUTY = "duty"
    """(duty: Jet, tendon, values) -> Jet: the share of all that it has which the servo gives [1]:
    a motor's duty cycle, else its force over its limit."""
    MOTOR_FORCE = "motor_force"
    """(force: Jet, tendon, values) -> Jet: the motor's force at the spool [N], pulling or pushing,
    after the servo's own limit."""
    SPOOL_FORCE = "spool_force"
    """(force: Jet, tendon, values) -> Jet: what the spool gives its string of it [N]."""
    SLIDING = "sliding"
    """(side: Jet, tendon, values) -> Jet: by what share bristles are bent [1]."""
    TENSION = "tension"
    """(force: Jet, tendon, values) -> Jet: what dry friction leaves of it at the load cell [N]."""
    ENCODER = "encoder"
    """(angle: Jet, tendon, values) -> Jet: the angle [rad] reported, given `tendon.tension`."""
    LINE = "line"
    """(force: Jet, tendon, values) -> Jet: what a string that stretches carries at its load cell
    [N], where its spool has a coordinate of its own."""
    TRANSMISSION = "transmission"
    """(force: Jet, tendon, values) -> Jet: what reaches the mechanism [N]."""
    SPEED = "speed"
    """(limit: real, values) -> real: the motor's greatest speed [rad/s]."""
    SPRING = "spring"
    """(torque: Jet, joint, values) -> Jet: a joint's return spring [N m]."""
    DAMPING = "damping"
    """(torque: Jet, joint, values) -> Jet: a joint's viscous damping [N m]."""
    JOINT_FRICTION = "joint_friction"
    """(limit: real, joint, values) -> real: a joint's dry friction [N m]."""
    INERTIA = "inertia"
    """(scale: real, values) -> real: how much more than their weight the links resist [1]."""
    TILT = "tilt"
    """(angle: real, values) -> real: how far the bench is tipped about +y [rad]."""
    CELL_CLOCK = "cell_clock"
    """(time: real, values) -> real: the instant [s] whose force the load cell reports."""
    CELL_LAG = "cell_lag"
    """(time_constant: real, values) -> real: the load cell's own lag [s]."""
    CELL = "cell"
    """(force: real, time: real, values) -> real: what the load cell makes of a force [N]."""
    JOINT_READING = "joint_reading"
    """(joints, time [s], values) -> joints: what encoders on joints make of their motion [rad, m],
    shapes (S, J) and (S,). No motion depends on it: like the next it has no device code."""
    TIP_READING = "tip_reading"
    """(tip, time [s], values) -> tip: what a camera makes of a tip's x and z [m], shape (S, 2)."""
    CURRENT_READING = "current_reading"
    """(current, time [s], values) -> current: what is read of a motor's [A], shape (S, D)."""
    VOLTAGE_READING = "voltage_reading"
    """(supply, time [s], values) -> supply: a motor's force [N], and the share by which its supply
    is read lower [1], shape (S, 2)."""


READINGS = {
    Stage.JOINT_READING: ("joint", "slide"),
    Stage.TIP_READING: ("tip",),
    Stage.CURRENT_READING: ("current",),
    Stage.VOLTAGE_READING: ("voltage",),
}
"""Stages of further sensors -> the signals that show them."""


class Effect(DeviceCode):
    """One physical cause of a gap between a simulation and its bench.

    Subclasses are never instantiated: an effect is its declaration, and its numbers live in a
    model. An effect acts in each `Stage` that names one of its device functions.
    """

    side: ClassVar[Literal["actuator", "transmission", "mechanism", "sensor"]]
    parameters: ClassVar[tuple[Parameter, ...]]
    dry: ClassVar[tuple[str, ...]] = ()
    """Parameters that make a tendon stick where they are not zero."""
    smooth: ClassVar[tuple[str, ...]] = ()
    """Parameters with which bristles bend before dry friction slides, and nothing sticks."""
    undamped: ClassVar[bool] = False
    """Whether what damps its contact or its string is left out, or is known in one form alone."""
    switches: ClassVar[tuple[str, ...]] = ()
    """Parameters that decide when a force jumps, so that no slope tells where they are best."""
    confused: ClassVar[tuple[str, ...]] = ()
    """Effects that leave much the same residual: a search tries one in the place of the other."""
    includes: ClassVar[tuple[str, ...]] = ()
    """Effects that are special cases of this one: the simpler is named if both explain the data."""
    needs_string: ClassVar[bool] = False
    """Whether it is about a string, its guides or its spool: a shaft has none of these."""
    spool_stages: ClassVar[tuple[Stage, ...]] = ()
    """Stages that stand for the motion of a spool without inertia. Where the spool has a
    coordinate of its own, its equation of motion takes their place."""
    memory: ClassVar[Stage | None] = None
    """Stage after which an effect with internal state renews it; see `renewals`."""
    memory_parameter: ClassVar[int] = 0
    """Place of the parameter at whose null value nothing needs to be renewed."""
    counts_to: ClassVar[int | None] = None
    """Place of the parameter [s] up to which a memory counts the seconds, whatever its sign: the
    effect acts otherwise from there on, and a step is divided there."""

    @classmethod
    def hook(cls, stage: Stage) -> Callable[..., Any] | None:
        """Return the effect's device function of a stage, None where it does not act."""
        return getattr(cls, stage.value, None)

    @classmethod
    def renewals(cls) -> tuple[Callable[..., Any], ...]:
        """Return the device functions of an effect's internal state, none without.

        `remember` gives the first number of each tendon or joint, `remember_second` the second:
        (signal: Jet, tendon | joint, values) -> real. The number is the memory once `elapsed` [s]
        have passed since it was `values[3]`, or `values[4]`, with the signal as the stage left it.
        A very long `elapsed` asks for the relaxed state.
        """
        names = ("remember", "remember_second")
        return tuple(getattr(cls, name) for name in names if hasattr(cls, name))

    @classmethod
    def is_of_servo(cls, *, independent: bool = False) -> bool:
        """Tell whether each of several servos may have its own.

        Independent servos move fingers of their own, whose joints are their own too. All of them
        still have one log's clock and one base, which may be tipped.
        """
        if independent and cls.side == "mechanism":
            return cls.hook(Stage.TILT) is None
        shared = cls.hook(Stage.PERIOD) or cls.further_signals()
        return cls.side != "mechanism" and not shared

    @classmethod
    def acts_on_cell_only(cls) -> bool:
        """Tell whether the effect changes nothing but what the load cell reads."""
        return cls._acts_only_in({Stage.CELL_CLOCK, Stage.CELL_LAG, Stage.CELL})

    @classmethod
    def further_signals(cls) -> tuple[str, ...]:
        """Return the signals without which nothing shows it: none but for a further sensor's."""
        of_sensor = cls._acts_only_in(READINGS)
        return tuple(s for stage, own in READINGS.items() if of_sensor and cls.hook(stage)
                     for s in own)  # fmt: skip

    @classmethod
    def _acts_only_in(cls, own: Container[Stage]) -> bool:
        """Tell whether the effect acts in no other stages."""
        return all(cls.hook(stage) is None for stage in Stage if stage not in own)


def lowered(supply: Array, sag: float) -> Array:
    """Return a force [N] and the share by which its supply is lower [1], by more of it [1/N]."""
    return supply + sag * np.abs(supply[:, :1]) * (0.0, 1.0)


def earlier(signal: Array, time: Array, delay: float) -> Array:
    """Return a signal (S, C) as it was some time [s] before each row, by a cubic spline."""
    return CubicSpline(time, signal)(np.maximum(time - delay, time[0]))
