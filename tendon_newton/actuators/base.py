"""What every actuator model declares."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from tendon_newton.parameters import Parameter


class Actuator:
    """How a servo turns a position error into a force at its spool.

    Subclasses are never instantiated: an actuator is its declaration, and its numbers live in a
    model.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    force: ClassVar[Callable[..., Any]]
    """Device function (error: Jet, tendon, p) -> Jet: force at the spool [N], or torque [N m] of a
    direct drive."""
    held: ClassVar[bool] = False
    """Whether its force [N] is decided outside the kernels once per control step, and held."""
    kinematic: ClassVar[bool] = False
    """Whether it moves its shaft whatever that carries: positions are all that is computed."""
    rotor: ClassVar[bool] = False
    """Whether it has a rotor, whose inertia stands between the motor and the load cell."""
    stiffness: ClassVar[str | None] = None
    """Parameter by which it answers a small turn of its shaft [N/rad]; None where none tells."""
    armature: ClassVar[Callable[..., Any]]
    """Device function (p) -> real: inertia of rotor and gear at the spool [kg m2]."""
