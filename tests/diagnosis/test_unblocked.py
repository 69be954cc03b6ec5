"""Recordings in which something is in the way are left out, and that is said."""

from pathlib import Path

from tendon_newton.data.dataset import Dataset
from tendon_newton.diagnosis.unblocked import unblocked
from tests.importers.logs import recording


def logs(*obstacles: str) -> Dataset:
    """A dataset whose two splits have these obstacles each."""
    train, test = (
        tuple(recording(f"{split}_{k}.csv", obstacle=o) for k, o in enumerate(obstacles))
        for split in ("train", "test")
    )
    return Dataset(path=Path(), train=train, test=test)


def test_only_what_nothing_blocked_is_diagnosed() -> None:
    """A hand and a roll of tape go, in both splits; the notes count them."""
    found, notes = unblocked(logs("free", "hand", "tape_roll", "hand", "free"))
    assert [r.name for r in found.train] == ["train_0.csv", "train_4.csv"]
    assert [r.name for r in found.test] == ["test_0.csv", "test_4.csv"]
    fitted, reported = notes
    assert "In 3 of 5 training recordings" in fitted
    assert "(hand in 2, tape_roll in 1): no fit and no decision sees them" in fitted
    assert "In 3 of 5 test recordings" in reported
    assert "the held-out error is without them" in reported


def test_nothing_is_said_where_nothing_is_in_the_way() -> None:
    """The same recordings, and no note."""
    data = logs("free", "free")
    assert unblocked(data) == (data, ())


def test_what_is_blocked_throughout_is_diagnosed_with_a_warning() -> None:
    """There is nothing else to fit: the answer says that a foreign force is in it."""
    data = logs("hand", "hand")
    found, (fitted, _) = unblocked(data)
    assert (found.train, found.test) == (data.train, data.test)
    assert "none are without, so their force is taken for an error of the model" in fitted
