"""What a search and its decision may take of a budget of time, and what decides in that time."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.search_spans import SEARCHED_SECONDS, deciding

SEARCH_SHARE = 0.6  # Share of a budget that the search may take; deciding takes the rest [1]
SEARCHED, DECIDED = 2300, 300
"""Candidates that are simulated on beginnings, and on what decides, where there are several causes:
1,900 to 2,600, and 170 to 400, on three planted sets and on 36 minutes of recordings."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Ends of the parts of a diagnosis, and what decides."""

    searched: float  # Instant of the monotonic clock from which nothing further is looked for [s]
    decided: float  # Instant from which no more is tested on parts that no number has seen [s]
    beginnings: float  # Length of all beginnings together, on which sets are chosen [s]
    decides_apart: bool  # Whether more than the beginnings decides


def limits_of(
    budget: float | None,
    pace: float | None,
    recordings: Sequence[Recording],
    *,
    whole: bool = False,
) -> Limits:
    """Share a budget of time.

    Where time is short, beginnings are shorter. Where the decision would take too long, they decide
    themselves: their sets are fitted already.

    Args:
        budget: Time for search and decision [s]; None where it does not matter.
        pace: Time that a candidate takes for a second of recordings [1].
        recordings: Training recordings as they are.
        whole: Whether all of them decide, however long they are.
    """
    if budget is None:
        return Limits(
            searched=np.inf, decided=np.inf, beginnings=SEARCHED_SECONDS, decides_apart=True
        )
    start = time.monotonic()
    first, is_affordable = SEARCHED_SECONDS, True
    if pace is not None:
        first = min(first, SEARCH_SHARE * budget / (SEARCHED * pace))
        seconds = sum(r.duration for r in deciding(recordings, whole=whole))
        taken = DECIDED * pace * seconds
        is_affordable = taken <= (1.0 - SEARCH_SHARE) * budget
    return Limits(
        searched=start + SEARCH_SHARE * budget,
        decided=start + budget,
        beginnings=first,
        decides_apart=is_affordable,
    )
