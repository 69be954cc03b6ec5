"""The operator at a terminal: what verbs that drive a bench ask, say and show."""

from __future__ import annotations

import os
import sys
import time
from typing import TYPE_CHECKING, Self, TextIO

from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_hardware.control.operator import OperatorProgress


VERDICT_COLOURS = {"good": 32, "note": 33, "fix": 31}
"""Green, yellow and red, by ANSI's numbers; the words stand there too."""


def coloured(text: str, colour: int) -> str:
    """Return a text in a colour of the terminal; plain in a file, or where NO_COLOR is set."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return text
    return f"\033[{colour}m{text}\033[0m"


def audible() -> TextIO:
    """Return where the operator hears what must not go unseen, with --quiet too."""
    unheard = getattr(sys.stdout, "name", None) == os.devnull
    return sys.stderr if unheard else sys.stdout


class Terminal:
    """The operator at a terminal, or a log file in their place."""

    def __init__(self) -> None:
        self.lively = sys.stdout.isatty()
        self.period = 0.2 if self.lively else 10.0
        self.next = 0.0
        self.line = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.end_line()

    def ask(self, text: str) -> None:
        """Ask, and wait for Enter."""
        self.end_line()
        if not sys.stdin.isatty():
            raise InvalidParameter(f"someone at a terminal must be asked: {text}")
        print(f"\n>> {text}\n>> Enter when done, Ctrl-C to end. ", end="", file=audible())
        audible().flush()
        input()

    def announce(self, text: str) -> None:
        """Say what comes next."""
        self.end_line()
        print(text, flush=True)

    def tell(self, text: str) -> None:
        """Say it so that it is seen."""
        self.end_line()
        print(f"!! {text}", flush=True, file=audible())

    def show(self, progress: OperatorProgress) -> None:
        """Show the figures on one line that changes, or now and then a new one."""
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + self.period
        if self.lively:
            print(f"\r{progress.text:100s}", end="", flush=True)
            self.line = True
        else:
            print(progress.text, flush=True)

    def end_line(self) -> None:
        """Go to a new line where figures stand on this one."""
        if self.line:
            print()
        self.line = False
