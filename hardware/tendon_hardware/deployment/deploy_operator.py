"""An operator who may go away while the motor runs: a closed terminal must not stop the loop."""

import contextlib
from dataclasses import dataclass
from math import degrees

from tendon_hardware.control.operator import Operator, OperatorProgress


@dataclass(frozen=True, kw_only=True, slots=True)
class DeployProgress(OperatorProgress):
    """Goal, positions, greatest force and warmth, and timing now."""

    mode: str  # ``run``, ``hold``, ``unwind`` or ``off``
    # Goal angle, or of a jog the spool's [rad]; the rate of a policy that turns [rad/s]
    goal: float
    turns: bool = False  # Whether a ball is turned
    position: tuple[float, ...]  # Spool angle of each servo [rad]
    command: tuple[float, ...]  # Desired spool angles [rad]
    estimated: bool  # Whether the force is a network's estimate
    late: float  # 99 % of the ticks were less late than this [s]
    skipped: int  # Ticks that were skipped

    @property
    def text(self) -> str:
        """The figures as a line, of 80 characters for one servo; lost: skipped or missed."""
        force = "no force"
        if self.force is not None:
            force = f"{self.force:.1f} N{' est.' if self.estimated else ''}"
        warmth = "" if self.temperature is None else f"  {self.temperature:.0f} degC"
        goal = f"{self.goal:.2f} rad/s" if self.turns else f"{degrees(self.goal):.0f} deg"
        spools = ", ".join(
            f"{position:.2f}->{command:.2f}"
            for position, command in zip(self.position, self.command, strict=True)
        )
        return (
            f"{self.mode} {self.elapsed:.0f} s  goal {goal}  spool "
            f"{spools} rad  {force}{warmth}  "
            f"late {1e3 * self.late:.1f} ms  {self.skipped + self.missed} lost"
        )


class AbsentableOperator:
    """Hands everything on to an operator, and goes on where nobody is there to hear it.

    Writing to a terminal that is gone fails. The signal that says so lets the tendon out, for which
    the loop must go on.
    """

    def __init__(self, operator: Operator) -> None:
        self._operator = operator

    def ask(self, text: str) -> None:
        """Ask, which needs someone who answers."""
        self._operator.ask(text)

    def announce(self, text: str) -> None:
        """Say what comes next, if it can be heard."""
        with contextlib.suppress(OSError, ValueError):
            self._operator.announce(text)

    def tell(self, text: str) -> None:
        """Say something, if it can be heard."""
        with contextlib.suppress(OSError, ValueError):  # ValueError: the stream is closed
            self._operator.tell(text)

    def show(self, progress: OperatorProgress) -> None:
        """Show the figures, if they can be seen."""
        with contextlib.suppress(OSError, ValueError):
            self._operator.show(progress)
