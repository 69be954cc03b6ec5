"""The exam of faults in its small form; ``python -m tests.faults`` is the large one.

Faults of a deployment stand in ``tests/hardware/deploy/test_rules_on_a_bench.py``, and kills in
``tests/hardware/deploy/test_real_time.py``.
"""

import pytest

from tests.faults.calm import LENGTH, calm
from tests.faults.camera import CAMERA
from tests.faults.collecting import COLLECTING
from tests.faults.outside import OUTSIDE


@pytest.mark.parametrize("name", COLLECTING)
def test_a_fault_ends_a_recording_in_time(name: str) -> None:
    """The motor is off, and the reason names the load cell; a spike ends nothing."""
    COLLECTING[name].examine(0.3)


@pytest.mark.parametrize("name", CAMERA)
def test_a_camera_is_believed_where_it_is_right(name: str) -> None:
    """Silent, frozen and old frames lose the ball; one wrong line or a fresh start does not."""
    CAMERA[name].examine(0)


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_fault_around_a_run_is_acted_upon(name: str) -> None:
    """Refused with its own words, or obeyed in time."""
    OUTSIDE[name](1)


def test_nothing_that_is_right_is_stopped() -> None:
    """A deployment and a recording, drawn, run to their ends."""
    row = calm(2.0 * LENGTH / 3600.0, lambda text: None)
    assert row["acted"] == row["runs"] == 2
