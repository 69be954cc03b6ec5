"""The bench of a reproduction, as far as this package knows one."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol


class ReproductionBench(Protocol):
    """Makes recordings and lets policies climb; real recordings need none."""

    def record(self, unit: int, out: Path, *, seed: int, most: int | None) -> None:
        """Record the paper's plan and its further experiments on one unit.

        Args:
            unit: Number of the unit.
            out: Its folder; what is there is not recorded again.
            seed: Seed of the plan's draws.
            most: Train runs of each kind; all of the plan if none.
        """
        ...

    def climb(self, unit: int, policy: Path, out: Path) -> float:
        """Let a policy climb the paper's stairs on one unit and return its tip error, RMS [m]."""
        ...
