"""Something in a finger's way, anew for each episode: a policy learns to hold, not only to move."""

import numpy as np
import torch
from torch import Tensor

from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import (
    FRICTION,
    STIFFNESS,
    Box,
    Obstacle,
    Plane,
    Sphere,
)
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import ObstacleChoice
from tendon_train.policy.worlds.goal_path import GoalPath
from tendon_train.policy.worlds.world_draws import WorldDraws

SIZES = (0.006, 0.020)
"""Least and greatest radius of a ball, or half of a box's edges [m]: a marble to an egg."""
ASIDE = 0.5  # How far to the side of the tip's path its middle may be, as a share of its size [1]
AHEAD = 1.0e-3  # Angle over which the direction of the tip's path is taken [rad]
FINGER_POINTS = 12  # Points along the open finger that an obstacle must leave alone [1]
TRIES = 8  # Draws until an obstacle does; after that the episode has none
FAR = np.array([0.0, 0.0, -10.0])  # Place of the obstacle until it is drawn [m]


def with_obstacle(mechanism: Mechanism, shape: ObstacleChoice) -> Mechanism:
    """Return a mechanism with something that may be put in its way.

    Args:
        shape: What it is; ``none`` leaves the finger alone.

    Raises:
        InvalidAsset: When built: no link of the finger carries a capsule to meet it with.
    """
    obstacles: dict[str, Obstacle] = {
        "sphere": Sphere(position=FAR, radius=SIZES[0]),
        "box": Box(position=FAR, half_size=np.full(3, SIZES[0])),
        "plane": Plane(position=FAR, normal=np.array([0.0, 0.0, 1.0])),
    }
    return mechanism if shape == "none" else mechanism.with_obstacles(obstacles[shape])


class ObstaclePlacer:
    """Puts the obstacle of each world where the tip would meet it, or takes it away.

    The tip would meet the obstacle at a goal angle that is drawn like a goal. Its size, stiffness,
    friction and distance to the side are drawn too. An obstacle that would overlap the open finger
    is drawn again.

    Args:
        loop: Worlds of a mechanism `with_obstacle`.
        goals: Least and greatest goal angle [rad].
        chance: Share of the episodes with it [1].
        spread: Most that its stiffness and friction differ from their defaults, as a share [1].
    """

    def __init__(
        self,
        loop: ControlLoop,
        shape: ObstacleChoice,
        path: GoalPath,
        *,
        goals: tuple[float, float],
        chance: float,
        spread: float,
        draws: WorldDraws,
    ) -> None:
        self._shape, self._path, self._goals = shape, path, goals
        self._chance, self._spread = chance, spread
        self._draws = draws
        names = ("position", "rotation", "size", "stiffness", "friction")
        self._numbers = {name: loop.bench_numbers(f"obstacle_{name}")[:, 0] for name in names}
        # Radius of each world's thickest link [m], shape (W,)
        self._thickness = loop.bench_numbers("capsule_radius").amax(dim=1).float()
        open_tip = path.points(torch.full_like(self._thickness[:1], path.range[0]))
        shares = torch.linspace(0.0, 1.0, FINGER_POINTS, device=open_tip.device)
        self._finger = shares[:, None] * open_tip  # Points along the open finger [m], shape (N, 3)

    def draw(self, worlds: Tensor) -> None:
        """Give some worlds, a mask of shape (W,), an obstacle anew, or none."""
        position, rotation, size = self._place(worlds)
        clear = self._is_clear(position, rotation, size)
        for _ in range(TRIES - 1):
            again = self._place(worlds)
            kept = clear.reshape(-1, 1)
            position = torch.where(kept, position, again[0])
            rotation = torch.where(kept[..., None], rotation, again[1])
            size = torch.where(kept, size, again[2])
            clear = self._is_clear(position, rotation, size)
        there = clear & (self._draws.uniform(worlds=worlds) < self._chance)
        drawn = {
            "position": position,
            "rotation": rotation,
            "size": size,
            "stiffness": STIFFNESS * self._factor(worlds) * there,
            "friction": FRICTION * self._factor(worlds),
        }
        for name, values in drawn.items():
            own = self._numbers[name]
            chosen = worlds.reshape(-1, *[1] * (own.ndim - 1))
            own.copy_(torch.where(chosen, values.to(own.dtype), own))

    def _place(self, worlds: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Draw position [m], (W, 3), rotation, (W, 3, 3), and size [m], (W, 3)."""
        low, high = self._goals
        tip, direction, side = self._meeting(
            low + (high - low) * self._draws.uniform(worlds=worlds)
        )
        size = SIZES[0] + (SIZES[1] - SIZES[0]) * self._draws.uniform(3, worlds=worlds)
        if self._shape == "sphere":
            size = size[:, 2:].expand(-1, 3)
        if self._shape == "plane":
            size = torch.zeros_like(size)
        aside = size[:, :1] * ASIDE * (2.0 * self._draws.uniform(1, worlds=worlds) - 1.0)
        position = tip + (self._thickness[:, None] + size[:, 2:]) * direction + aside * side
        rotation = torch.stack([side, torch.linalg.cross(-direction, side), -direction], dim=-1)
        return position, rotation, size

    def _meeting(self, alpha: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return where the tip is at goal angles, where it goes, and what lies beside it."""
        tip = self._path.points(alpha)
        low, high = self._path.range
        before = self._path.points((alpha - AHEAD).clamp(min=low))
        after = self._path.points((alpha + AHEAD).clamp(max=high))
        direction = torch.nn.functional.normalize(after - before, dim=-1)
        across = torch.linalg.cross(direction, tip)
        return tip, direction, torch.nn.functional.normalize(across, dim=-1)

    def _is_clear(self, position: Tensor, rotation: Tensor, size: Tensor) -> Tensor:
        """Tell which obstacles leave the open finger alone, shape (W,)."""
        local = torch.einsum("wab,wna->wnb", rotation, self._finger - position[:, None])
        if self._shape == "sphere":
            distance = torch.linalg.vector_norm(local, dim=-1) - size[:, :1]
        elif self._shape == "box":
            distance = (local.abs() - size[:, None]).clamp(min=0.0).norm(dim=-1)
        else:
            distance = local[..., 2]
        return (distance > self._thickness[:, None]).all(dim=-1)

    def _factor(self, worlds: Tensor) -> Tensor:
        """Return a factor about one for each world, shape (W,)."""
        return 1.0 + self._spread * (2.0 * self._draws.uniform(worlds=worlds) - 1.0)
