"""Times that a person types, and waits for."""

import re
import time

from tendon_newton.errors import InvalidParameter

DURATION = re.compile(r"(\d+(?:\.\d+)?)\s*(s|min|h)?")
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, None: 1.0}


def read_duration(text: str, option: str) -> float:
    """Return a time such as 90s, 5min or 1h [s]; a bare number is in seconds.

    Raises:
        InvalidParameter: It is none, or not above zero.
    """
    found = DURATION.fullmatch(text.strip())
    seconds = 0.0 if found is None else float(found[1]) * UNITS[found[2]]
    if seconds <= 0.0:
        raise InvalidParameter(
            f"{option} must be a time above zero such as 90s, 5min or 1h; it is {text!r:.40}"
        )
    return seconds


class TimeLeft:
    """Tells how much of some work is done and how long the rest will take, at this pace.

    Args:
        total: All of the work, in seconds of simulated time [s].
    """

    def __init__(self, total: float) -> None:
        self.total, self.done, self.start = total, 0.0, time.monotonic()

    def __call__(self, part: float) -> None:
        """Tell it after a part of the work [s]; the end tells itself."""
        self.done += part
        left = (time.monotonic() - self.start) * (self.total / self.done - 1.0)
        if self.done < self.total:
            words = f"{self.done:.0f} of {self.total:.0f} s simulated, about {left:.0f} s left"
            print(f"  {words}", flush=True)
