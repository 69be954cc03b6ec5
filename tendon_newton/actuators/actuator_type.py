"""What every actuator model declares."""

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from tendon_newton.data.parameters import Parameter
from tendon_newton.device_code.placeholders import Jet, ParameterVector, real
from tendon_newton.device_code.structs import Tendon
from tendon_newton.device_code.templates import DeviceCode

__all__ = ["Actuator", "Jet", "Parameter", "ParameterVector", "Tendon", "real"]


class Actuator(DeviceCode):
    """How a servo turns a position error into a force at its spool.

    Subclasses are never instantiated: an actuator is its declaration, and its numbers live in a
    model.
    """

    parameters: ClassVar[tuple[Parameter, ...]]
    held: ClassVar[bool] = False
    """Whether its force [N] is decided outside the kernels once per control step, and held."""
    kinematic: ClassVar[bool] = False
    """Whether it moves its shaft whatever that carries: positions are all that is computed."""
    leads: ClassVar[bool] = False
    """Whether its shaft is where it was measured: forces are computed, not angles of the shaft."""
    rotor: ClassVar[bool] = False
    """Whether it has a rotor, whose inertia stands between the motor and the load cell."""
    stiffness: ClassVar[str | None] = None
    """Parameter by which it answers a small turn of its shaft [N/rad]; None where none tells."""
    doubtful: ClassVar[tuple[str, ...]] = ()
    """Parameters that data sheets and firmware state badly or not at all, such as a rotor's."""
    modulated: ClassVar[bool] = False
    """Whether it drives its motor by a duty cycle; else its force over its limit counts as one."""
    gives_way: ClassVar[bool] = False
    """Whether it takes no supply voltage as given, so that one that falls is an effect's doing."""
    duty: ClassVar[Callable[..., Any]]
    """Device function (error: Jet, tendon, p) -> Jet: the duty cycle that it asks for [1]."""
    driven: ClassVar[Callable[..., Any]]
    """Device function (duty: Jet, tendon, p) -> Jet: its force at a duty cycle."""

    @staticmethod
    def force(error: Jet, tendon: Tendon, p: ParameterVector) -> Jet:
        """Return the force at the spool [N], torque [N m] of a direct drive; 0 if none is known."""
        return Jet(real(0.0), real(0.0), real(0.0))

    @staticmethod
    def armature(p: ParameterVector) -> real:
        """Return the inertia of rotor and gear at the spool [kg m2]; 0 where none shows."""
        return real(0.0)

    @staticmethod
    def current(force: real, tendon: Tendon, p: ParameterVector) -> real:
        """Return the current [A] of a motor that gives a force [N]; the force if none is known."""
        return force

    @classmethod
    def draw(cls, values: Mapping[str, float | str], radius: float) -> float | None:
        """Return the motor's current for each newton at a spool [A/N]; None if none is known."""
        return None

    @classmethod
    def richer(
        cls, values: Mapping[str, float | str], force_limit: float, radius: float
    ) -> tuple[str, dict[str, float]] | None:
        """Return an actuator that says more and rests as this one does; None where none is known.

        Args:
            values: This actuator's numbers.
            force_limit: Greatest force of the servo [N], or torque [N m] of a shaft.
            radius: Radius of the spool [m]; a shaft counts as 1 m.

        Returns:
            Kind and numbers, `doubtful` ones among them as they usually are.
        """
        return None

    @classmethod
    def static_force(cls, values: Mapping[str, float | str], error: float, radius: float) -> float:
        """Return the force [N], or torque [N m] of a shaft, for a standing position error.

        Args:
            values: The actuator's numbers.
            error: Position error [rad].
            radius: Radius of the spool [m]; a shaft counts as 1 m.

        Returns:
            The force before the limit of the bench's servo; infinite where nothing tells, 0 where
            positions are all that is known.
        """
        if cls.kinematic:
            return 0.0
        return math.inf if cls.stiffness is None else float(values[cls.stiffness]) * error
