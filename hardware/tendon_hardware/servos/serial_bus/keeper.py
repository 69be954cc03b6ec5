"""A watchdog for servos that have none: a process beside the program, on the same port."""

import contextlib
import os
import select
import subprocess
import sys
import time
from pathlib import Path

from tendon_hardware.errors import HardwareFault
from tendon_hardware.servos.serial_bus import keeper_process

START_TIME = 10.0  # Longest start of the process [s]; it takes some hundredths
ANSWER_TIME = 1.0
"""Longest wait for its answer [s]: one that was stopped, or gets no time, watches over nothing."""
END_TIME = 0.5  # Longest wait for its end [s]


class Keeper:
    """Switches a motor off when this program dies, hangs or is killed, and opens a lost port again.

    Where both are killed, or the cable fails, the servo's own firmware ends a pull that nobody
    renews.

    Args:
        baud: Rate of the bus [1/s].
        port: Descriptor of the servo's open port.
        lock: Descriptor of the port's lock, so that no other program has the port before the motor
            is off.
        patience: Silence after which it acts [s].

    Raises:
        HardwareFault: The process does not start.
    """

    def __init__(
        self, path: str, *, baud: int, port: int, lock: int, patience: float, packet: bytes
    ) -> None:
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-I", "-S", str(Path(keeper_process.__file__))),
                *(path, str(baud), str(port), str(lock), str(patience), packet.hex()),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=(port, lock),
            start_new_session=True,
        )
        self._patience = patience
        self._asked: float | None = None
        if not self._answered(START_TIME):
            self._process.kill()
            raise HardwareFault("the process that watches over the motor must start; it did not")

    @property
    def ended(self) -> bool:
        """Whether it has come to its end: nothing more will be written to the port."""
        return self._process.poll() is not None

    @property
    def fault(self) -> str | None:
        """Reason why nothing watches over the motor now; None where all is well."""
        if self.ended and self._process.returncode == keeper_process.TRIPPED:
            return f"no instruction came for {self._patience:g} s"
        if self.ended:
            return "the process that watches over its motor was ended by something else"
        if self._asked is None or self._answered() or time.monotonic() < self._asked + ANSWER_TIME:
            return None
        return f"the process that watches over its motor has not answered for {ANSWER_TIME:g} s"

    def feed(self) -> None:
        """Tell it that the program goes on."""
        self._answered()
        self._say(b".")
        if self._asked is None:
            self._asked = time.monotonic()

    def release(self) -> None:
        """Let it go: the motor is off."""
        self._say(keeper_process.RELEASE)
        self.abandon()
        self._process.kill()  # where it was stopped it cannot go by itself
        self._process.wait()

    def abandon(self) -> None:
        """Close what leads to it and wait for its end, but not for long.

        Unless it was let go before, it acts at once, for as long as it takes: the motor may be on.
        """
        for end in (self._process.stdin, self._process.stdout):
            if end is not None:
                with contextlib.suppress(OSError):
                    end.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_TIME)

    def _answered(self, limit: float = 0.0) -> bool:
        """Tell whether it has said something, within a time [s]."""
        out = self._process.stdout
        if out is None or out.closed or not select.select([out], [], [], limit)[0]:
            return False
        self._asked = None
        return bool(os.read(out.fileno(), 4096))

    def _say(self, word: bytes) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(OSError, ValueError):  # it is gone, or was let go
                self._process.stdin.write(word)
                self._process.stdin.flush()
