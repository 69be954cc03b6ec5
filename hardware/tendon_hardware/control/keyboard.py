"""Single keys of a terminal, without Enter and without waiting."""

import os
import select
import sys
import termios
import tty
from typing import Any, Self

KEYS = {
    f"\x1b{mode}{letter}".encode(): name
    for mode in "[O"
    for letter, name in zip("ABCD", ("up", "down", "right", "left"), strict=True)
}
"""Bytes of a terminal for the arrow keys, in either of its modes."""
STOP_KEYS = {" ": "the space bar", "q": "key q"}  # Keys that end a run in an orderly way
KILL_KEYS = {"x": "key x"}  # Keys that switch the motor off at once
PIECE = 256  # Bytes taken at a time


class Keyboard:
    """The keys of a terminal; where there is none, no key ever comes.

    Used as a context; afterwards the terminal is as it was.

    Args:
        number: File descriptor; the standard input's unless given.
    """

    def __init__(self, number: int | None = None) -> None:
        self._number = number
        self._before: list[Any] | None = None

    def __enter__(self) -> Self:
        if self._number is None:
            try:
                self._number = sys.stdin.fileno()
            except (AttributeError, OSError, ValueError):  # closed, or not a file
                return self
        if os.isatty(self._number):
            self._before = termios.tcgetattr(self._number)
            tty.setcbreak(self._number)
        return self

    def __exit__(self, *error: object) -> None:
        if self._before is not None and self._number is not None:
            before, self._before = self._before, None
            try:
                termios.tcsetattr(self._number, termios.TCSADRAIN, before)
            except termios.error:  # the terminal is gone
                return

    @property
    def there(self) -> bool:
        """Whether there is a terminal."""
        return self._before is not None

    def pressed(self) -> list[str]:
        """Return the keys that were pressed since the last call."""
        if self._before is None or self._number is None:
            return []
        if not select.select([self._number], [], [], 0.0)[0]:
            return []
        try:
            return split_keys(os.read(self._number, PIECE))
        except OSError:  # the terminal is gone; SIGHUP says so as well
            return []


def split_keys(data: bytes) -> list[str]:
    """Return what a terminal has sent as keys; what is no key of ours is left out."""
    keys: list[str] = []
    place = 0
    while place < len(data):
        name = KEYS.get(data[place : place + 3])
        if name is not None:
            keys.append(name)
            place += 3
            continue
        character = chr(data[place])
        if character.isascii() and character.isprintable():
            keys.append(character)
        place += 1
    return keys
