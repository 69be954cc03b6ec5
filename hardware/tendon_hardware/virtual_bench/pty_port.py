"""A pseudo-terminal that behaves like a USB serial adapter, at a path that stays the same."""

import contextlib
import fcntl
import os
import struct
import termios
import tty
from pathlib import Path

BAUD_CODES = {
    getattr(termios, f"B{baud}"): baud
    for baud in (
        *(9_600, 38_400, 57_600, 115_200, 500_000),
        *(1_000_000, 2_000_000, 3_000_000, 4_000_000),
    )
}
BACKLOG = 3000
"""Bytes that nobody has read after which the oldest are thrown away, as a driver's ring does."""


class PtyPort:
    """One end for a server; the other is a path that any serial program opens.

    The server keeps the client's end open as well, so that closing and opening the port again is
    no hang-up. Unplugging closes both: the client gets an input/output error and the path is gone
    until the adapter is back.

    Args:
        path: Symbolic link to the terminal that a client opens.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._server = self._client = -1
        self.plug()

    @property
    def is_plugged(self) -> bool:
        """Whether the path is there."""
        return self._server >= 0

    def plug(self) -> None:
        """Make the terminal and the path to it."""
        if self.is_plugged:
            return
        self._server, self._client = os.openpty()
        for end in (self._server, self._client):
            tty.setraw(end)
        os.set_blocking(self._server, False)
        os.chmod(os.ttyname(self._client), 0o666)  # noqa: PTH101  # a device, not a file
        fresh = self.path.with_suffix(".new")
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(os.ttyname(self._client))
        fresh.replace(self.path)

    def unplug(self) -> None:
        """Hang up and take the path away."""
        if not self.is_plugged:
            return
        self.path.unlink(missing_ok=True)
        os.close(self._server)
        os.close(self._client)
        self._server = self._client = -1

    def fileno(self) -> int:
        """Return the server's end, for ``select``."""
        return self._server

    @property
    def baud(self) -> int | None:
        """Speed that the client has set [bit/s]; ``None`` for one that no servo knows."""
        return BAUD_CODES.get(termios.tcgetattr(self._client)[5])

    def read(self) -> bytes:
        """Return what the client has sent, empty where it has sent nothing."""
        try:
            return os.read(self._server, 4096)
        except OSError:  # nothing there
            return b""

    def write(self, data: bytes) -> None:
        """Send bytes to the client, throwing away the oldest where nobody reads."""
        if not self.is_plugged:
            return
        waiting = struct.unpack("i", fcntl.ioctl(self._client, termios.FIONREAD, b"\0" * 4))[0]
        if waiting + len(data) > BACKLOG:
            termios.tcflush(self._client, termios.TCIFLUSH)
        with contextlib.suppress(BlockingIOError):
            os.write(self._server, data)
