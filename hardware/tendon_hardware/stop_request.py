"""An orderly end when someone asks for one: Ctrl-C, a closed terminal, a shutdown."""

import signal
import threading
from types import FrameType
from typing import Self

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """Notes the first signal, so that a transaction on the bus can end; the second interrupts.

    A signal in the middle of a transaction would leave the bus in use for ever, and the motor on.
    Used as a context; outside the main thread, which alone gets signals, it notes nothing.
    """

    def __init__(self) -> None:
        self.signal: str | None = None  # Name of the signal that came
        # Whether the program looks at this often; if not, a signal interrupts at once
        self.patient = False
        self._before: dict[int, object] = {}

    def __enter__(self) -> Self:
        for number in SIGNALS if threading.current_thread() is threading.main_thread() else ():
            self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # pyright: ignore[reportArgumentType]

    def _note(self, number: int, frame: FrameType | None) -> None:
        first = self.signal is None
        self.signal = signal.Signals(number).name
        if not (first and self.patient):
            raise KeyboardInterrupt
