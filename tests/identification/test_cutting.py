"""One long log in two parts that share no row."""

import numpy as np
import pytest

from tendon_newton.identification.cutting import hold_out
from tests.importers.logs import recording


def test_what_is_held_out_is_the_end_and_nothing_of_it_is_fitted() -> None:
    """The two parts put together are the recording, row by row."""
    time = np.arange(800) / 80.0
    theta = np.sin(time)[:, None]
    whole = recording(
        time=time,
        motor_position=theta,
        motor_velocity=np.cos(time)[:, None],
        command=theta,
        force=theta + 2.0,
    )
    (train,), (test,) = hold_out([whole], 0.3)
    np.testing.assert_array_equal(np.concatenate([train.time, test.time]), whole.time)
    np.testing.assert_array_equal(
        np.concatenate([train.motor_position, test.motor_position]), whole.motor_position
    )
    assert test.duration / whole.duration == pytest.approx(0.3, abs=2.0 / 800)
    assert (train.start, test.start) == (whole.start, "first_row")
