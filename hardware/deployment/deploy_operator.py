"""An operator who may go away while the motor runs: a closed terminal must not stop the loop."""

from __future__ import annotations

import contextlib

from hardware.control.operator import Operator, Progress


class AbsentableOperator:
    """Hands everything on to an operator, and goes on where nobody is there to hear it.

    Writing to a terminal that is gone fails. The signal that says so lets the tendon out, for which
    the loop must go on.

    Args:
        operator: Receiver of the messages.
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

    def show(self, progress: Progress) -> None:
        """Show the figures, if they can be seen."""
        with contextlib.suppress(OSError, ValueError):
            self._operator.show(progress)
