"""How a deployment is going, as its operator sees it."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees

from hardware.operator import Progress


@dataclass(frozen=True, kw_only=True, slots=True)
class DeployProgress(Progress):
    """Goal, position, force, warmth and timing now."""

    mode: str
    """``run``, ``hold``, ``unwind`` or ``off``."""
    goal: float
    """Goal angle, or of a jog the spool's [rad]."""
    position: float
    """Spool angle [rad]."""
    command: float
    """Desired spool angle [rad]."""
    estimated: bool
    """Whether the force is a network's estimate."""
    late: float
    """99 % of the ticks were less late than this [s]."""
    skipped: int
    """Ticks that were skipped."""

    @property
    def text(self) -> str:
        """The figures as a line of 80 characters: what was skipped or missed is lost."""
        force = "no force"
        if self.force is not None:
            force = f"{self.force:.1f} N{' est.' if self.estimated else ''}"
        warmth = "" if self.temperature is None else f"  {self.temperature:.0f} degC"
        return (
            f"{self.mode} {self.elapsed:.0f} s  goal {degrees(self.goal):.0f} deg  spool "
            f"{self.position:.2f}->{self.command:.2f} rad  {force}{warmth}  "
            f"late {1e3 * self.late:.1f} ms  {self.skipped + self.missed} lost"
        )
