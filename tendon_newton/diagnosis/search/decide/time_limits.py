"""What a search and its decision may take of a budget of time, and what decides in that time."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from tendon_newton.diagnosis.search.refit import ROUGH_STEP
from tendon_newton.diagnosis.search.spans import LEAST_SECONDS, MOST_SECONDS

SEARCH_SHARE = 0.5
"""Share of a budget that the search may take; deciding takes the rest [1]."""
CANDIDATES = 350
"""Candidates that are simulated on what decides where there are several causes."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Ends of the parts of a diagnosis, and what decides."""

    searched: float
    """Instant of the monotonic clock from which nothing further is looked for [s]."""
    decided: float
    """The same of tests on parts that no number has seen."""
    seconds: float
    """Length of all that decides together [s]."""
    step: float
    """Step of its simulation [s]."""


def limits_of(budget: float | None, pace: float | None, step: float) -> Limits:
    """Share a budget of time.

    Where time is short fewer seconds decide. Where that does not suffice they are simulated at the
    search's step, which the numbers of a cause hardly notice.

    Args:
        budget: Time for search and decision [s]; None where it does not matter.
        pace: Time that a candidate takes for a second of recordings at the search's step [1].
        step: The finer step of a decision [s].
    """
    if budget is None:
        return Limits(searched=np.inf, decided=np.inf, seconds=MOST_SECONDS, step=step)
    start = time.monotonic()
    rough = MOST_SECONDS * ROUGH_STEP / step
    if pace is not None:
        rough = (1.0 - SEARCH_SHARE) * budget / (CANDIDATES * pace)
    seconds, step = rough * step / ROUGH_STEP, step
    if seconds < LEAST_SECONDS:
        seconds, step = rough, max(step, ROUGH_STEP)
    return Limits(
        searched=start + SEARCH_SHARE * budget,
        decided=start + budget,
        seconds=float(np.clip(seconds, LEAST_SECONDS, MOST_SECONDS)),
        step=step,
    )
