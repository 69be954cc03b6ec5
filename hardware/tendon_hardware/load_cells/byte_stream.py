"""Bytes of a serial port with the instant at which each piece arrived, read in a thread.

The loop that drives the servo looks for readings once per tick only. Dates of the loop would be up
to a tick late. That lateness drifts as slowly as the two clocks themselves do, so that no fit could
tell the one from the other.
"""

import os
import select
import threading
from collections import deque
from contextlib import suppress
from typing import Any, Protocol

from tendon_hardware.clock import Clock
from tendon_hardware.errors import PortUnavailable
from tendon_hardware.serial_ports import LOST, PortLock, reason

BAUD = 115_200  # Rate of the ports [1/s], which USB ignores; the camera's lines are a quarter of it
PIECE = 4096  # Most bytes taken at once


class ByteStream(Protocol):
    """Where a load cell's bytes come from; a simulated cell has one without a port."""

    name: str  # Name of the source in errors

    def open(self) -> None:
        """Begin to receive."""

    def close(self) -> None:
        """Stop; more than once does no harm."""

    def receive(self) -> list[tuple[float, bytes]]:
        """Return arrival [s] and bytes of each piece since the last call, without waiting.

        Raises:
            OSError: The port is gone.
        """
        ...


class SerialStream:
    """A serial port as a stream of dated bytes."""

    def __init__(self, port: str, *, clock: Clock) -> None:
        self.name = port
        self._clock = clock
        self._lock = PortLock(port)
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._stop: tuple[int, int] | None = None
        self._thread: threading.Thread | None = None
        self._fault: OSError | None = None

    def open(self) -> None:
        """Lock and open the port and start the thread.

        Raises:
            PortBusy: Another process holds the port.
            PortUnavailable: The port is not there or may not be opened.
        """
        import serial

        self._lock.acquire()
        try:
            port = serial.Serial(self.name, BAUD, timeout=0)
            port.reset_input_buffer()
        except (*LOST, ValueError) as error:
            self._lock.release()
            raise PortUnavailable(f"{self.name}: cannot be opened; {reason(error)}") from error
        self._fault = None
        self._stop = os.pipe()
        self._thread = threading.Thread(
            target=self._listen, args=(port, self._stop[0]), name="load cell", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop the thread and give the port back."""
        if self._stop is not None:
            wake, self._stop = self._stop, None
            os.write(wake[1], b"\0")
            if self._thread is not None:
                self._thread.join()
            for end in wake:
                os.close(end)
        self._lock.release()

    def receive(self) -> list[tuple[float, bytes]]:
        """Return what has arrived.

        Raises:
            OSError: The port is gone and all that it had sent was returned.
        """
        pieces = [self._pieces.popleft() for _ in range(len(self._pieces))]
        if not pieces and self._fault is not None:
            raise self._fault
        return pieces

    def _listen(self, port: Any, stop: int) -> None:
        file: int = port.fileno()
        try:
            while stop not in select.select([file, stop], [], [])[0]:
                data = os.read(file, PIECE)
                if not data:
                    raise OSError("it hung up")
                self._pieces.append((self._clock.now(), data))
        except OSError as error:
            self._fault = error
        finally:
            with suppress(*LOST):
                port.close()
