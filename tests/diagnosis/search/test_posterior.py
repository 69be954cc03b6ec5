"""Models are drawn as a diagnosis leaves them open: whole sets, numbers together."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.diagnosis.posterior import (
    ENDING,
    Coordinate,
    FittedSet,
    OpenNumber,
    Posterior,
    read_posterior,
    write_posterior,
)
from tendon_newton.errors import InvalidDiagnosis

FORCE = ("coulomb_friction", "force")
DELAY = ("command_delay", "delay")
SPEED = ("speed_limit", "speed")


OWN = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=0.0, upper=10.0)
INVERSE = Coordinate(kind="inverse", origin=8.0, unit=1.0, lower=0.0, upper=4.0)


def number(key: tuple[str, str], place: float, scale: Coordinate = OWN) -> OpenNumber:
    """Return a number in a coordinate, by default its own unit from 0 to 10."""
    return OpenNumber(owner=key[0], name=key[1], coordinate=scale, place=place)


SURE = FittedSet(
    weight=0.7,
    causes=("coulomb_friction",),
    numbers=(number(FORCE, 5.0), number(("bench", "mass_mcp"), 4.0)),
    covariance=np.array([[0.04, 0.054], [0.054, 0.09]]),
)
SUSPECTED = FittedSet(
    weight=0.3,
    causes=("command_delay", "coulomb_friction", "speed_limit"),
    numbers=(
        number(FORCE, 2.0), number(("bench", "mass_mcp"), 4.0), number(DELAY, 1.0),
        number(SPEED, 0.1, INVERSE),
    ),
    covariance=np.diag([0.04, 0.09, 1.0, 0.04]),
)  # fmt: skip
BOTH = Posterior(sets=(SURE, SUSPECTED))
COUNT = 20_000


def drawn_from(own: FittedSet) -> dict[tuple[str, str], np.ndarray]:
    """Return draws of a set's numbers, by owner and name."""
    normal = np.random.default_rng(0).normal(size=(COUNT, len(own.numbers)))
    return {(n.owner, n.name): v for n, v in zip(own.numbers, own.at(normal).T, strict=True)}


def test_numbers_scatter_as_wide_as_their_intervals_and_together() -> None:
    """Deviations of 0.2 and 0.3 with a correlation of 0.9; 20,000 draws tell them to 1 %."""
    drawn = drawn_from(SURE)
    force, mass = drawn[FORCE], drawn["bench", "mass_mcp"]
    assert (force.mean(), mass.mean()) == pytest.approx((5.0, 4.0), rel=0.01)
    assert (force.std(), mass.std()) == pytest.approx((0.2, 0.3), rel=0.02)
    assert np.corrcoef(force, mass)[0, 1] == pytest.approx(0.9, abs=0.01)


def test_draws_stay_within_ranges() -> None:
    """A number that the data leave open is about where they put it, in its range."""
    wild = replace(SURE, covariance=np.diag([1.0e6, 1.0e6]))
    drawn = drawn_from(wild)
    for values in drawn.values():
        assert values.min() >= 0.0
        assert values.max() <= 10.0
        assert 2.0 < values.std() < 2.5  # a quarter of the range


def test_what_is_drawn_hundreds_of_times_too_stiff_to_matter_is_rigid() -> None:
    """A limit of 8 per unit is drawn up to 800, or not at all: half of 2 % around none are."""
    near = replace(SURE, numbers=(number(SPEED, 0.0, INVERSE),), covariance=np.array([[1.0e-4]]))
    drawn = drawn_from(near)[SPEED]
    assert np.isinf(drawn).mean() == pytest.approx(0.84, abs=0.01)  # one deviation from none
    assert drawn[np.isfinite(drawn)].max() <= 800.0


def test_a_set_without_a_number_comes_back_from_its_file(tmp_path: Path) -> None:
    """Of several servos nothing is stated with a tolerance: no cause is no number there."""
    none = FittedSet(weight=1.0, causes=(), numbers=(), covariance=np.zeros((0, 0)))
    write_posterior(tmp_path / "diagnosis.json", Posterior(sets=(none,)))
    (own,) = read_posterior(tmp_path / "diagnosis.json").sets
    assert (own.causes, own.numbers, own.covariance.shape) == ((), (), (0, 0))
    assert own.at(np.zeros((3, 0))).shape == (3, 0)


def test_a_posterior_comes_back_from_its_file(tmp_path: Path) -> None:
    """To the bit; a file that is none is refused in one line that says how to mend it."""
    path = tmp_path / "diagnosis.json"
    write_posterior(path, BOTH)
    for one, again in zip(BOTH.sets, read_posterior(path).sets, strict=True):
        assert (again.weight, again.causes) == (one.weight, one.causes)
        found = drawn_from(again)
        assert all(np.array_equal(found[key], values) for key, values in drawn_from(one).items())
    file = path.with_suffix(ENDING)
    whole = json.loads(file.read_text())
    for spoilt, said in (
        ({"schema": 2}, "schema must be 1"),
        ({"sets": [{**whole["sets"][0], "covariance": [[1.0]]}]}, "table of 2 x 2"),
        ({"sets": [{**whole["sets"][0], "weight": -1.0}]}, "weight must be > 0"),
    ):
        file.write_text(json.dumps(whole | spoilt))
        with pytest.raises(InvalidDiagnosis, match=said):
            read_posterior(path)
    file.unlink()
    with pytest.raises(InvalidDiagnosis, match="diagnose the data again with this release"):
        read_posterior(path)
