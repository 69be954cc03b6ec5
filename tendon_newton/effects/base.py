"""What every physical effect declares: its stage, its parameters with their null values, its equation and its source."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any, ClassVar, Literal

from tendon_newton.parameters import Parameter


class Stage(Enum):
    """Where in a control step an effect acts, in the order of the signal; the device function's signature follows from it.

    `values` are the effect's own parameters in the order of its declaration. A `Jet` is a signal with its derivatives by
    position and by velocity, so sums, differences and multiples of jets carry the derivatives along.
    """

    CLOCK = "clock"
    """(time: real, values) -> real: the instant [s] at which the servo reads the command."""
    ANGLE = "angle"
    """(angle: Jet, tendon, values) -> Jet: the motor angle [rad] that the encoder reports."""
    ERROR = "error"
    """(error: Jet, tendon, values) -> Jet: the position error [rad] that the servo acts on."""
    MOTOR_FORCE = "motor_force"
    """(force: Jet, tendon, values) -> Jet: the motor's force at the spool [N], pulling or pushing."""
    TENSION = "tension"
    """(force: Jet, tendon, values) -> Jet: what friction leaves of it at the load cell [N]."""
    TRANSMISSION = "transmission"
    """(force: Jet, tendon, values) -> Jet: what reaches the mechanism [N]."""
    SPRING = "spring"
    """(torque: Jet, joint, values) -> Jet: a joint's return spring [N m]."""
    DAMPING = "damping"
    """(torque: Jet, joint, values) -> Jet: a joint's viscous damping [N m]."""


class Effect:
    """One physical cause of a gap between a simulation and its bench.

    Subclasses are never instantiated: an effect is its declaration, and its numbers live in a model.
    """

    name: ClassVar[str]
    side: ClassVar[Literal["actuator", "transmission", "mechanism", "sensor"]]
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    dry: ClassVar[bool] = False
    """Whether it is a friction that sticks; its first parameter is then the strength, null at 0."""
    includes: ClassVar[tuple[str, ...]] = ()
    """Effects that this one contains as special cases: the simpler one is named when both explain the data."""
    apply: ClassVar[Callable[..., Any]]
    """The device function of the stage."""
