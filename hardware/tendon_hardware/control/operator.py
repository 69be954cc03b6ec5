"""Who stands at the bench, as far as a program can tell: what it asks, says and shows."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, kw_only=True, slots=True)
class OperatorProgress:
    """State of a run that is going on."""

    name: str  # Name of the run
    elapsed: float  # Since its first row [s]
    duration: float  # Length of the run [s]
    rate: float  # Rows per second lately [Hz]
    missed: int  # Readings of the servo that never came
    force: float | None  # Last tension [N]
    temperature: float | None  # Temperature of the motor [degC]

    @property
    def text(self) -> str:
        """The figures as a line."""
        force = "  no force" if self.force is None else f"{self.force:7.2f} N"
        warmth = "" if self.temperature is None else f"  {self.temperature:3.0f} degC"
        return (
            f"{self.name}  {self.elapsed:5.1f} of {self.duration:.0f} s  {self.rate:5.1f} Hz  "
            f"{self.missed} missed  {force}{warmth}"
        )


class Operator(Protocol):
    """Someone who can be asked to do something at the bench."""

    def ask(self, text: str) -> None:
        """Ask for something to be done and wait until it is."""

    def announce(self, text: str) -> None:
        """Say what comes next."""

    def tell(self, text: str) -> None:
        """Say something that must not go unseen."""

    def show(self, progress: OperatorProgress) -> None:
        """Show how a run is going."""
