"""A refresh that was interrupted goes on, and no other one does."""

from pathlib import Path

import pytest

from tendon_newton.errors import InvalidOutput
from tendon_train.refresh.ledger import Ledger


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    """Results come back as they were written, tuples as lists."""
    first = Ledger(tmp_path / "refresh.json", {"model": "ab", "logs": ("a", "b")})
    assert first.done("drift") is None
    first.finish("drift", {"verdict": "worn", "causes": ("x",)})
    again = Ledger(tmp_path / "refresh.json", {"model": "ab", "logs": ("a", "b")})
    assert again.done("drift") == {"verdict": "worn", "causes": ["x"]}
    assert again.done("training") is None


def test_other_inputs_are_refused(tmp_path: Path) -> None:
    """The message says what differs; so is a file that is none."""
    path = tmp_path / "refresh.json"
    Ledger(path, {"model": "ab"}).finish("drift", {})
    with pytest.raises(InvalidOutput, match="began with model = 'ab', and now it is 'cd'"):
        Ledger(path, {"model": "cd"})
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InvalidOutput, match="must be JSON"):
        Ledger(path, {"model": "ab"})


def test_a_ledger_without_a_place_is_named(tmp_path: Path) -> None:
    """A folder that is not there."""
    with pytest.raises(InvalidOutput, match="nowhere"):
        Ledger(tmp_path / "nowhere" / "refresh.json", {}).finish("drift", {})
