"""Recordings in which nothing is in the mechanism's way: the others hold a force of no model."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.recording import FREE, Recording


def unblocked(dataset: Dataset) -> tuple[Dataset, tuple[str, ...]]:
    """Leave out recordings with a stated obstacle, where others of their split remain.

    An obstacle in some recordings is no cause, since a cause acts in all of them. A hand pushes
    where and when its owner likes, and a roll of tape stops the mechanism where it lies.

    Returns:
        What is diagnosed, and a sentence for each split with obstacles.
    """
    train, test = free(dataset.train), free(dataset.test)
    notes = (
        *obstacle_sentences(dataset.train, train, "training", "no fit and no decision sees them"),
        *obstacle_sentences(dataset.test, test, "test", "the held-out error is without them"),
    )
    return replace(dataset, train=train, test=test), notes


def free(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the recordings without an obstacle; all of them where each has one."""
    return tuple(r for r in recordings if r.obstacle == FREE) or tuple(recordings)


def obstacle_sentences(
    recordings: Sequence[Recording], kept: Sequence[Recording], split: str, consequence: str
) -> tuple[str, ...]:
    """Say in how many recordings of a split something is in the way, and what follows."""
    counts = Counter(r.obstacle for r in recordings if r.obstacle != FREE)
    if not counts:
        return ()
    if len(kept) == len(recordings):
        consequence = "none are without, so their force is taken for an error of the model"
    words = ", ".join(f"{word} in {count}" for word, count in counts.items())
    return (
        f"In {counts.total()} of {len(recordings)} {split} recordings something is in the "
        f"mechanism's way, which no model knows ({words}): {consequence}.",
    )
