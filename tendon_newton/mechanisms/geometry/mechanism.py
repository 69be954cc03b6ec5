"""A bench: joints, links, springs, tendons, and what is in its way."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import newton

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.joints import Joint, JointKind, freeze_arrays
from tendon_newton.mechanisms.geometry.meetings import Meeting, find_meetings
from tendon_newton.mechanisms.geometry.obstacles import Obstacle
from tendon_newton.mechanisms.geometry.parts import Tendon, Tip


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """Joints, links, springs and tendons of one bench; joint j is also body j and DOF j."""

    name: str
    """Name of the asset's folder, or of its default prim for a file elsewhere."""
    asset: Path
    """The USD file that it came from."""
    joints: tuple[Joint, ...]
    """Joints in the order of the degrees of freedom."""
    tendons: tuple[Tendon, ...]
    tip: Tip | None
    """The point that recordings follow, where the asset has a site named ``tip``."""
    gravity: Array
    """Acceleration of gravity [m/s^2], shape (3,)."""
    template: newton.ModelBuilder = field(repr=False, compare=False)
    """One world, as Newton read it from the asset."""
    obstacles: tuple[Obstacle, ...] = ()
    """Obstacles in its way; see `with_obstacles`."""
    meetings: tuple[Meeting, ...] = field(init=False, repr=False)
    """Which of its own links may meet, by its `LinkObstacle`s."""

    def __post_init__(self) -> None:
        freeze_arrays(self)
        object.__setattr__(self, "meetings", find_meetings(self.template, self.obstacles))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def joint_kinds(self) -> tuple[JointKind, ...]:
        """Kinds of the joints."""
        return tuple(joint.kind for joint in self.joints)

    @property
    def parents(self) -> tuple[int, ...]:
        """Parent of each joint, -1 for the base."""
        return tuple(joint.parent for joint in self.joints)

    @property
    def joint_limits(self) -> tuple[tuple[float, float], ...]:
        """Ends of each joint's range [rad]."""
        return tuple(joint.limits for joint in self.joints)

    def with_obstacles(self, *obstacles: Obstacle) -> Mechanism:
        """Return this mechanism with further things in its way.

        Links meet them with the capsules that the asset draws. Every simulator then simulates
        contact; a mechanism without obstacles costs nothing more. An
        obstacle with a mass moves, in `ControlLoop` and `TendonSolver`. A `LinkObstacle` is one of
        its own links, which those of other fingers meet.

        Raises:
            InvalidParameter: A link is named that cannot meet another.
            UnknownName: No link has such a name.
        """
        return replace(self, obstacles=(*self.obstacles, *obstacles))

    def refuse_moving_obstacle(self, host: str) -> None:
        """Refuse an obstacle with a mass on behalf of a host that keeps obstacles where they are.

        Raises:
            InvalidParameter: There is one.
        """
        if any(obstacle.mass is not None for obstacle in self.obstacles):
            raise InvalidParameter(
                f"{host} keeps obstacles where they are, and one of {self.name!r} has a mass: "
                "step it with ControlLoop or TendonSolver"
            )
