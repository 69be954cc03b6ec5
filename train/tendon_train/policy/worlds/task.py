"""What the hands of an environment are for: a goal, what is seen besides servos, what is paid."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class TaskOutcome:
    """What a step has brought."""

    reward: Tensor  # Before what a change of the actions costs, shape (W,)
    # Worlds whose episode ends by a failure, shape (W,), where a task knows any
    failed: Tensor | None
    # Means over all worlds for the learning curve, by the names of `CURVE_FIGURES`
    log: Mapping[str, Tensor]


class Task(Protocol):
    """A task of W hands.

    A new episode calls `place` before its worlds are reset and `begin` after that. A step calls
    `score`, then `renew`.
    """

    goal: Tensor  # What is asked for: angles [rad] or rates [rad/s], shape (W,)
    # Greatest command at the start of an episode [rad], where the servos have a greater one
    greatest_start: float

    def place(self, worlds: Tensor) -> dict[str, Tensor]:
        """Draw what stands in some worlds, a mask, and return what else their reset is given."""
        ...

    def begin(self, worlds: Tensor) -> None:
        """Give goals to episodes that begin."""
        ...

    def score(self) -> TaskOutcome:
        """Judge a step."""
        ...

    def renew(self, ended: Tensor) -> None:
        """Change goals within episodes; those of worlds that have ended are drawn by `begin`."""
        ...

    def seen(self) -> tuple[Tensor, ...]:
        """Return what a policy sees behind the goal, shape (W, N); nothing of most tasks."""
        ...

    def hidden(self) -> Tensor | None:
        """Return what only the critic sees, shape (W, M), where there is something."""
        ...
