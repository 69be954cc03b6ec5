"""Which rows a search looks at, which decide, and what both may take of a budget of time."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Recording
from tendon_newton.identification.cutting import beginning

SEARCH_SHARE = 0.6  # Share of a budget that the search may take; deciding takes the rest [1]
SEARCHED, DECIDED = 2300, 300
"""Candidates that are simulated on beginnings, and on what decides, where there are several causes:
1,900 to 2,600, and 170 to 400, on three planted sets and on 36 minutes of recordings."""
SPAN, MOST_SPANS = 8.0, 9
"""Length of a beginning [s] on which sets are chosen, and recordings of which one is looked at."""
LEAST_SPAN, SEARCHED_SECONDS = 4.5, 40.0
"""Length of a beginning [s] at least, and of all of them together where they are longer."""
MOST_SECONDS = 80.0  # Length of what decides together [s] at most
MOST_DECIDING = 16  # Recordings of which beginnings decide where all are longer than that together
GOLDEN = 0.618034
"""Golden section: multiples of it, less their whole part, fill the range from 0 to 1 evenly."""


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


def beginnings(
    recordings: Sequence[Recording], seconds: float = SEARCHED_SECONDS, *, whole: bool = False
) -> tuple[Recording, ...]:
    """Return the first seconds of recordings, spread evenly over a long list, benches in turn.

    Args:
        recordings: Training recordings as they are.
        seconds: Length of all beginnings together [s], unless each would be below `LEAST_SPAN`.
        whole: Whether to return all there is: a shaft that only follows its commands costs little.
    """
    if whole:
        return tuple(recordings)
    chosen = spread(recordings, MOST_SPANS)
    span = min(SPAN, max(LEAST_SPAN, seconds / len(chosen)))
    return tuple(beginning(r, span) for r in chosen)


def deciding(recordings: Sequence[Recording], *, whole: bool = False) -> tuple[Recording, ...]:
    """Return the recordings, or beginnings of some of them where they are longer together.

    Args:
        recordings: Training recordings as they are.
        whole: As for `beginnings`.
    """
    if whole or sum(r.duration for r in recordings) <= MOST_SECONDS:
        return tuple(recordings)
    chosen = spread(recordings, MOST_DECIDING)
    return tuple(beginning(r, MOST_SECONDS / len(chosen)) for r in chosen)


def spread(recordings: Sequence[Recording], most: int) -> list[Recording]:
    """Return some of a long list of recordings, evenly spread, each bench and gain in turn.

    Where a condition has one place alone, its neighbours in the list take other motions: logs of a
    servo repeat the same motions at each gain, in the same order.
    """
    if len(recordings) <= most:
        return list(recordings)
    kinds: dict[tuple[str, str], list[Recording]] = {}
    for recording in recordings:
        kind = repr((recording.bench_overrides, dict(recording.actuator_overrides)))
        kinds.setdefault((recording.bench, kind), []).append(recording)
    share = max(1, most // len(kinds))
    chosen = []
    for turn, own in enumerate(kinds.values()):
        count = min(len(own), share)
        places = (np.arange(count) + turn * GOLDEN % 1.0) * len(own) / count
        chosen += [own[int(place)] for place in places]
    return chosen
