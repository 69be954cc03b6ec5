"""A spool that has slipped: how far, from logs in which the tendon hangs loose at times."""

import numpy as np
import pytest

from tendon_newton.data.model_file import Model
from tendon_train.refresh.slip import SlipComparison, best_offset, taut_from, with_slip
from tests.physics.runs import ideal_model
from tests.train.refresh.test_drift import FITTED, log_of


def offset_of(model: Model) -> float:
    """Return the offset [rad] that a model has."""
    (own,) = (effect.values for effect in model.effects if effect.name == "position_offset")
    return float(own["angle"])


def test_a_tendon_is_taut_above_the_open_finger() -> None:
    """A spool that has slipped by 0.48 rad leaves it loose about as much farther."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.006})
    before = taut_from([log_of(FITTED, 1)], FITTED)
    # the same commands pull less on it, and let the finger open farther, by 0.13 rad
    assert taut_from([log_of(worn, 1)], FITTED) == pytest.approx(before + 0.48, abs=0.15)


@pytest.mark.parametrize("length", [0.0, 0.0025, 0.006])
def test_a_slip_is_found_where_the_tendon_is_taut(length: float) -> None:
    """Loose tendon of some length is an offset of the encoder; the loose rows do not count."""
    loose = {"tendon_slack": {"length": length}} if length else {}
    worn = ideal_model(coulomb_friction={"force": 0.6}, **loose)
    corrected = with_slip([log_of(worn, 1)], FITTED)
    assert offset_of(corrected) == pytest.approx(length / 0.0125, abs=0.01)  # two steps of the grid
    assert corrected.effects[0] == FITTED.effects[0]


def test_an_offset_of_the_model_is_replaced() -> None:
    """What is found is the new total."""
    worn = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.3})
    before = ideal_model(coulomb_friction={"force": 0.6}, position_offset={"angle": 0.1})
    corrected = with_slip([log_of(worn, 2)], before)
    assert [effect.name for effect in corrected.effects] == ["coulomb_friction", "position_offset"]
    assert offset_of(corrected) == pytest.approx(0.3, abs=0.01)  # two steps of the grid


def test_rows_below_the_open_finger_do_not_count() -> None:
    """Two thirds of the rows are loose and agree on no slip; the others say what it is."""
    offset = np.array([0.0, 0.2, 0.4])
    simulated = np.r_[np.full(40, 0.1), np.linspace(0.5, 1.0, 20)]
    measured = np.r_[np.full(40, 0.1), simulated[40:] + 0.4]
    error = measured - (simulated + offset[:, None])
    assert best_offset(SlipComparison(offset=offset, angle=measured, error=error), 0.2) == 2
