"""Gaps of the servo's readings during a run: noticed, told and marked, never filled."""

from tendon_hardware.clock import Clock
from tendon_hardware.control.operator import Operator
from tendon_hardware.errors import SafetyStop
from tendon_hardware.logs.session_log import SessionLog
from tendon_hardware.safety_rules.bench_limits import SafetyLimits

WORTH_TELLING = 0.5
"""Gap that the operator is told of [s]."""
STALE = 0.25
"""Age of the last reading beyond which a loop on the host must not act on it [s]."""


class GapWatch:
    """Knows when the servo was last heard of.

    Args:
        clock: The bench's clock.
        limits: How long it may be silent.
        operator: Receiver of the messages.
    """

    def __init__(self, clock: Clock, limits: SafetyLimits, operator: Operator) -> None:
        self.clock = clock
        self.limits = limits
        self.operator = operator
        self.start = clock.now()
        """Instant from which gaps are counted [s]."""
        self.gaps: list[tuple[float, float]] = []
        """First and last instant of each gap, since the start [s]."""
        self._heard = clock.now()
        self._gap: float | None = None

    @property
    def stale(self) -> bool:
        """Whether the last reading is too old to act on."""
        return self.clock.now() - self._heard > STALE

    def begin(self) -> None:
        """Note that a reading is missing."""
        if self._gap is None:
            self._gap = self._heard

    def miss(self) -> None:
        """Note that a reading is missing, and give up after too many.

        Raises:
            SafetyStop: The servo has been silent for too long.
        """
        self.begin()
        silence = self.clock.now() - self._heard
        if silence > self.limits.silence:
            raise SafetyStop(
                f"the servo must answer; it has been silent for {silence:.1f} s: see that its "
                "motor is off"
            )

    def hear(self, instant: float, log: SessionLog | None) -> None:
        """Note a reading, and mark the gap that it ends."""
        begin, self._gap, self._heard = self._gap, None, instant
        if begin is None or log is None:
            return
        first, last = begin - self.start, instant - self.start
        self.gaps.append((first, last))
        text = f"no rows between {first:.3f} and {last:.3f} s"
        if last - first > WORTH_TELLING:
            self.operator.tell(f"The servo is back after {last - first:.1f} s: {text}.")
        log.event(
            instant, "servo", "warn", text, start=f"{first:.3f}", seconds=f"{last - first:.3f}"
        )
