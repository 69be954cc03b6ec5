"""Progress of a deployment, as its operator sees it."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees

from hardware.control.operator import Progress


@dataclass(frozen=True, kw_only=True, slots=True)
class DeployProgress(Progress):
    """Goal, positions, greatest force and warmth, and timing now."""

    mode: str
    """``run``, ``hold``, ``unwind`` or ``off``."""
    goal: float
    """Goal angle, or of a jog the spool's [rad]."""
    position: tuple[float, ...]
    """Spool angle of each servo [rad]."""
    command: tuple[float, ...]
    """Desired spool angles [rad]."""
    estimated: bool
    """Whether the force is a network's estimate."""
    late: float
    """99 % of the ticks were less late than this [s]."""
    skipped: int
    """Ticks that were skipped."""

    @property
    def text(self) -> str:
        """The figures as a line, of 80 characters for one servo; lost: skipped or missed."""
        force = "no force"
        if self.force is not None:
            force = f"{self.force:.1f} N{' est.' if self.estimated else ''}"
        warmth = "" if self.temperature is None else f"  {self.temperature:.0f} degC"
        spools = ", ".join(
            f"{position:.2f}->{command:.2f}"
            for position, command in zip(self.position, self.command, strict=True)
        )
        return (
            f"{self.mode} {self.elapsed:.0f} s  goal {degrees(self.goal):.0f} deg  spool "
            f"{spools} rad  {force}{warmth}  "
            f"late {1e3 * self.late:.1f} ms  {self.skipped + self.missed} lost"
        )
