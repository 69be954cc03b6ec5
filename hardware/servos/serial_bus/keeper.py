"""A watchdog for servos that have none: a process beside the program, on the same port."""

import contextlib
import select
import subprocess
import sys
from pathlib import Path

from hardware.errors import HardwareFault
from hardware.servos.serial_bus import keeper_process

START_TIME = 10.0
"""Longest start of the process [s]; it takes some hundredths."""


class Keeper:
    """Switches a motor off when this program dies, hangs or is killed.

    Nothing helps where the cable or the computer fails: then only the servo's supply ends it.

    Args:
        port: Descriptor of the servo's open port.
        lock: Descriptor of the port's lock, so that no other program has the port before the motor
            is off.
        patience: Silence after which it acts [s].
        packet: Instruction that switches the motor off.

    Raises:
        HardwareFault: The process does not start.
    """

    def __init__(self, port: int, *, lock: int, patience: float, packet: bytes) -> None:
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-I", "-S", str(Path(keeper_process.__file__))),
                *(str(port), str(patience), packet.hex()),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=(port, lock),
            start_new_session=True,
        )
        out = self._process.stdout
        ready = select.select([out], [], [], START_TIME)[0] if out is not None else []
        if not ready or out is None or out.read(1) != b"r":
            self._process.kill()
            raise HardwareFault("the process that watches over the motor must start; it did not")

    @property
    def tripped(self) -> bool:
        """Whether it has acted, or is gone: nothing watches any more."""
        return self._process.poll() is not None

    def feed(self) -> None:
        """Tell it that the program goes on."""
        self._say(b".")

    def release(self) -> None:
        """Let it go: the motor is off."""
        self._say(keeper_process.RELEASE)
        for end in (self._process.stdin, self._process.stdout):
            if end is not None:
                with contextlib.suppress(OSError):
                    end.close()
        self._process.wait()

    def abandon(self) -> None:
        """Let it act at once: the motor may be on, and this program gives it up."""
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _say(self, word: bytes) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(OSError, ValueError):  # it is gone, or was let go
                self._process.stdin.write(word)
                self._process.stdin.flush()
