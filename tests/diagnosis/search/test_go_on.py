"""Sets of causes are carried on to further recordings."""

import numpy as np
import pytest

from tendon_newton.diagnosis.posterior import Coordinate, FittedSet, OpenNumber, Posterior
from tendon_newton.diagnosis.search.decide.go_on import go_on
from tests.diagnosis.search.test_sets import TRUTH, log
from tests.physics.runs import ideal_model


def test_a_set_is_refitted_and_what_it_lacks_is_added() -> None:
    """Viscous friction at half its size goes to its size, and dry friction beside it is found."""
    scale = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=0.0, upper=10.0)
    number = OpenNumber(owner="viscous_friction", name="coefficient", coordinate=scale, place=0.6)
    known = FittedSet(
        weight=1.0, causes=("viscous_friction",), numbers=(number,), covariance=np.eye(1)
    )
    left = go_on([log(n) for n in range(3)], ideal_model(), Posterior(sets=(known,)))
    best, *_ = left.sets
    found = {n.owner: n.coordinate.value(n.place) for n in best.numbers}
    wanted = {cause: value for cause, own in TRUTH.items() for value in own.values()}
    assert set(best.causes) == set(wanted)
    assert {cause: found[cause] for cause in wanted} == pytest.approx(wanted, rel=0.1)
    assert sum(own.weight for own in left.sets) > 0.8
