"""Writing beside the control loop: a slow disk must not make it late."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from tendon_hardware.errors import LogNotWritten
from tendon_hardware.logs.mcap_file import McapFile
from tendon_hardware.logs.ros_messages import Message

WRITE_PERIOD = 0.02
"""Time between two writings [s]. Encoding holds the interpreter, 20 us a message. Ten at a time
make the loop late by 0.2 ms at most, and ten times as many would by 2 ms."""
SYNC_PERIOD = 0.4
"""Time between two waits for the disk [s]; what a power cut loses besides."""


class BackgroundLog:
    """Takes messages without waiting and writes them in a thread of its own.

    Args:
        file: File of the messages.
    """

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._waiting: deque[tuple[str, str, int, Message]] = deque()
        self._failure: LogNotWritten | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    def write(self, topic: str, kind: str, stamp: int, message: Message) -> None:
        """Take a message.

        Raises:
            LogNotWritten: The disk took no more, now or earlier.
        """
        if self._failure is not None:
            raise self._failure
        self._waiting.append((topic, kind, stamp, message))

    def flush(self, *, sync: bool) -> None:
        """Do nothing: the thread flushes by itself."""

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write all that is waiting, then the end of the file."""
        self._stop()
        if self._failure is not None:
            self._file.close()
            raise self._failure
        self._file.finish(metadata)

    def close(self) -> None:
        """Write all that is waiting and close the file as it is."""
        self._stop()
        with contextlib.suppress(LogNotWritten):
            self._file.flush(sync=True)
        self._file.close()

    def _stop(self) -> None:
        self._ending.set()
        self._thread.join()

    def _run(self) -> None:
        synced = time.monotonic()
        while self._failure is None:
            ending = self._ending.wait(WRITE_PERIOD)
            try:
                while self._waiting:
                    self._file.write(*self._waiting.popleft())
                due = time.monotonic() - synced >= SYNC_PERIOD
                self._file.flush(sync=due)
            except LogNotWritten as failure:
                self._failure = failure
                return
            if due:
                synced = time.monotonic()
            if ending:
                return
