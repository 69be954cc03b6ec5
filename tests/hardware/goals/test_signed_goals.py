"""Goals over the network count once, while they are young, from whoever has the key."""

from pathlib import Path

import pytest

from tendon_hardware.control.datagram_goals import is_loopback
from tendon_hardware.control.goals import open_goals
from tendon_hardware.control.signed_goals import (
    AGE_MAX,
    SignedGoals,
    read_key,
    signature,
    signed_goal,
)
from tendon_newton.errors import InvalidGoal, InvalidParameter

KEY = b"a key of thirty-two random bytes"
BOUNDS = (0.0, 1.57)


def test_a_signed_goal_counts_once() -> None:
    """The same datagram again is refused, as is one with a smaller number."""
    goals = SignedGoals(KEY)
    assert goals.goal(signed_goal(KEY, 0.5, 7, 100.0), 100.2) == "0.5"
    for number in (7, 6):
        with pytest.raises(InvalidGoal, match="counts once"):
            goals.goal(signed_goal(KEY, 0.6, number, 100.2), 100.2)
    assert goals.goal(signed_goal(KEY, 0.6, 8, 100.2), 100.2) == "0.6"


@pytest.mark.parametrize("sent", [100.0 - AGE_MAX - 0.01, 100.0 + AGE_MAX + 0.01, float("nan")])
def test_a_goal_of_another_time_is_refused(sent: float) -> None:
    """Too old, or of a clock that is ahead; it does not use its number up."""
    goals = SignedGoals(KEY)
    with pytest.raises(InvalidGoal, match="must be younger than 1 s"):
        goals.goal(signed_goal(KEY, 0.5, 9, sent), 100.0)
    assert goals.goal(signed_goal(KEY, 0.5, 1, 100.0), 100.0) == "0.5"


@pytest.mark.parametrize(
    "data",
    [
        b"0.5",
        b"",
        b"0.5 1 100",
        signed_goal(b"another key of some length", 0.5, 1, 100.0),
        signed_goal(KEY, 0.5, 1, 100.0).replace(b"0.5", b"0.6"),
        signed_goal(KEY, 0.5, 1, 100.0)[:-1],
        b"0.5 1 100 " + signature(KEY, "0.5 1 101").encode(),
        b"0.5 x 100 " + signature(KEY, "0.5 x 100").encode(),
        b"\xff \xfe 0 0",
    ],
)
def test_what_is_not_signed_as_it_stands_is_refused(data: bytes) -> None:
    """Each part is under the signature."""
    with pytest.raises(InvalidGoal):
        SignedGoals(KEY).goal(data, 100.0)


def test_a_key_is_long_and_its_owners_alone(tmp_path: Path) -> None:
    """A file that others may read is no secret."""
    path = tmp_path / "key"
    path.write_bytes(KEY)
    path.chmod(0o644)
    with pytest.raises(InvalidParameter, match="chmod 600"):
        read_key(path)
    path.chmod(0o600)
    assert read_key(path) == KEY
    path.write_bytes(b"short")
    with pytest.raises(InvalidParameter, match="16 to 1024 random bytes"):
        read_key(path)
    with pytest.raises(InvalidParameter, match="cannot be read"):
        read_key(tmp_path / "none")
    with pytest.raises(InvalidParameter, match="belongs to goals over UDP"):
        open_goals("stairs", BOUNDS, path)


def test_only_this_computers_own_addresses_need_no_key() -> None:
    """A name may lead anywhere."""
    own = ["127.0.0.1", "127.3.2.1", "localhost", "::1"]
    assert [host for host in (*own, "0.0.0.0", "10.0.0.1", "a.b") if is_loopback(host)] == own
