"""The comparison's tables, and its baseline."""

from dataclasses import replace

import numpy as np
import pytest

from examples.studies.comparison.four_numbers import Grid, fitted, simulate
from examples.studies.comparison.table import OURS, REPEATS, beside_rivals, tables


def test_a_row_that_was_not_made_waits() -> None:
    """Nothing stands in for a fit that nobody has made."""
    text = tables(
        {
            "xl330: test kp 100": {
                "data sheet": {
                    "held_out": 12.34,
                    "trained": 5.67,
                    "numbers": 0,
                    "seconds": 0.0,
                    "says": "",
                }
            }
        }
    )
    assert "| data sheet, nothing fitted | 12.3 (5.7) |" in text
    assert "| Rhoban/bam m6, refitted by its own program | waits |" in text
    assert "repeats" not in text


def test_a_diagnosis_stands_beside_the_best_of_all_others() -> None:
    """What no model can beat, and a split without a diagnosis, count for nothing."""
    rows = {"data sheet": 90.0, "Coulomb and viscous friction": 40.0, REPEATS: 4.0, OURS: 30.0}
    cells = {
        row: {"held_out": left, "says": "backlash", "seconds": 9.0} for row, left in rows.items()
    }
    alone = {OURS: cells[OURS]}
    text = beside_rivals({"so101: Jaw by a and b": cells, "xl330: test kp 100": alone})
    assert "| 30.0 | Coulomb and viscous friction | 40.0 | 0.75 | backlash | 9 s |" in text
    assert text.endswith("ratio: median 0.75, greatest 0.75")
    assert "kp 100" not in text


def test_lag_delay_deadband_and_offset_are_found() -> None:
    """A servo that is nothing else is told by its four numbers."""
    time = 0.005 * np.arange(600)
    command = np.stack([np.sign(np.sin(2.0 * time)), np.sin(3.0 * time)], axis=1)
    still = np.zeros_like(command)
    grid = Grid(command=command, position=still, enabled=still + 1.0, valid=still + 1.0)
    known = np.array([0.06, 0.02, 0.02, 0.05])
    found = fitted(replace(grid, position=simulate(grid, known)))
    assert np.abs(found) == pytest.approx(known, rel=0.05)  # a search downhill


def test_a_motor_that_is_off_stays() -> None:
    """The baseline knows no weight."""
    command = np.ones((50, 1))
    off = Grid(command=command, position=0.0 * command, enabled=0.0 * command, valid=command)
    assert np.all(simulate(off, np.array([0.05, 0.0, 0.0, 0.0])) == 0.0)
