"""A change beside a large one, and one that another imitates, by gains that are given."""

from types import SimpleNamespace
from typing import Any

from tendon_newton.diagnosis.in_time.changes import Days
from tendon_newton.diagnosis.in_time.walks import walk_of


class Few(Days):
    """Sets of slack and offset whose gains are given."""

    def __init__(self, **gains: float) -> None:
        none: Any = None
        self.mended, self.names = frozenset[str](), ("tendon_slack", "position_offset")
        self.gains = {frozenset(key.split("__")): value for key, value in gains.items()}
        self.fits = dict.fromkeys([*self.gains, frozenset[str]()], none)

    def gain(self, moved: frozenset[str]) -> float:
        """Return what was given."""
        return self.gains.get(moved, 0.0)


def test_what_a_large_change_leaves_for_others_is_not_free() -> None:
    """Beside 200 nat of slack another number must bring ten, and its odds besides."""
    odds = walk_of("position_offset").odds
    slack, both = frozenset(("tendon_slack",)), frozenset(("tendon_slack", "position_offset"))
    little, enough = (Few(tendon_slack=200.0, tendon_slack__position_offset=200.0 + odds + more)
                      for more in (9.0, 22.0))  # fmt: skip
    assert little.worth(both) < little.worth(slack)
    assert enough.worth(both) > enough.worth(slack)


def test_a_change_that_another_imitates_is_told_with_it() -> None:
    """Two nat behind in its place is a rival, four are not, and what did not move has none."""
    slack = frozenset(("tendon_slack",))
    behind = walk_of("position_offset").odds - walk_of("tendon_slack").odds
    for less, rivals in ((2.0, ("position_offset",)), (4.0, ())):
        days = Few(tendon_slack=50.0, position_offset=50.0 + behind - less)
        assert days.rivals("tendon_slack", slack) == rivals
        point: Any = SimpleNamespace(
            moved=slack, estimates=lambda _: {0: (1.0, 0.9, 1.1)}, gain=lambda _: 0.0
        )
        days.study = SimpleNamespace(  # type: ignore[assignment]
            parameter=lambda _: SimpleNamespace(name="length", unit="m"), base_value=lambda _: 0.0
        )
        (told,), (still,) = (days.changes(name, point) for name in days.names)
        assert (told.rivals, still.rivals) == (rivals, ())
