"""Parts of long data: beginnings on which sets are chosen, and what decides where there is much."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Recording
from tendon_newton.identification.cutting import beginning

SPAN, MOST_SPANS = 8.0, 9
"""Length of a beginning [s] on which sets are chosen, and recordings of which one is looked at."""
LEAST_SPAN, SEARCHED_SECONDS = 4.5, 40.0
"""Length of a beginning [s] at least, and of all of them together where they are longer."""
MOST_SECONDS = 80.0  # Length of what decides together [s] at most
MOST_DECIDING = 16  # Recordings of which beginnings decide where all are longer than that together

GOLDEN = 0.618034
"""Golden section: multiples of it, less their whole part, fill the range from 0 to 1 evenly."""


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
