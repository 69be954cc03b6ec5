"""Where the finger's tip is during a run, on a bench where something sees it."""

from hardware.benches.bench import Bench
from hardware.logs.session_log import SessionLog

PERIOD = 0.05
"""Time between two looks on a bench in real time [s], where asking takes long."""


class TipWatch:
    """Logs the tip; faster than real time at every tick, else now and then.

    Args:
        bench: An open bench.
    """

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._sees = bench.controls is not None
        self._next = 0.0

    def take(self, log: SessionLog | None) -> None:
        """Look where the tip is, if it is time."""
        clock = self.bench.clock
        now = clock.now()
        if not self._sees or log is None or now < self._next:
            return
        self._next = now if self.bench.lockstep else now + PERIOD
        tip = self.bench.tip()
        if tip is None:
            self._sees = False
        else:
            log.tip(clock.now(), *tip)
