"""What is true of a virtual bench during a run: where tip and ball are, and how joints stand."""

from tendon_hardware.benches.bench import Bench
from tendon_hardware.logs.session_log import SessionLog

PERIOD = 0.05  # Time between two looks on a bench in real time [s], where asking takes long


class TipWatch:
    """Logs what a virtual bench knows; faster than real time at every tick, else now and then."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._sees = bench.controls is not None
        self._next = 0.0

    def take(self, log: SessionLog | None) -> None:
        """Look at the bench, if it is time."""
        clock = self.bench.clock
        now = clock.now()
        controls = self.bench.controls
        if controls is None or not self._sees or log is None or now < self._next:
            return
        self._next = now if self.bench.lockstep else now + PERIOD
        state = controls.state()
        self._sees = state.tip is not None
        if state.tip is not None:
            log.tip(clock.now(), *state.tip)
        if state.ball is not None:
            log.truth(clock.now(), state.ball, state.joints)
