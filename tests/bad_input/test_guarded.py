"""Work in a process of its own: bounds that hold, errors of ours, nothing left of a death."""

import os
import sys
from pathlib import Path
from time import monotonic

import pytest

from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.errors import InvalidPolicyFile


def add(first: int, second: int) -> int:
    """Do something honest, and print."""
    sys.stdout.write("noise")
    return first + second


def refuse() -> None:
    """Raise an error of ours."""
    raise InvalidPolicyFile("this one is broken")


def fail() -> None:
    """Raise what a library raises."""
    raise IndexError("pop from empty list")


def grow() -> None:
    """Take more memory than there is."""
    kept = []
    while True:
        kept.append(bytes(1 << 24))


def spin() -> None:
    """Never end."""
    while True:
        pass


def die() -> None:
    """End the process without a word."""
    os.abort()


def listing() -> list[str]:
    """Say what lies in the working folder."""
    return [path.name for path in Path().iterdir()]


def test_a_result_comes_back() -> None:
    """What the work prints does not mix with what it gives."""
    assert guarded(add, 2, 3) == 5


def test_an_error_of_ours_comes_back_as_it_is() -> None:
    """Type and message."""
    with pytest.raises(InvalidPolicyFile, match=r"^this one is broken$"):
        guarded(refuse)


@pytest.mark.parametrize(
    ("work", "said"),
    [
        (grow, "takes more than 1024 MiB"),
        (spin, "takes more than 1 s of a core"),
        (die, "ends the process that looks at it"),
        (fail, "ends the process that looks at it: IndexError: pop from empty list"),
    ],
)
def test_what_would_take_the_machine_down_is_told(work, said: str) -> None:
    """Within seconds, and by one error."""
    began = monotonic()
    with pytest.raises(TooMuch, match=said):
        guarded(work, seconds=1)
    assert monotonic() - began < 10.0


def test_relative_names_lead_nowhere() -> None:
    """The work runs in an empty folder."""
    assert guarded(listing) == []
