"""What causes do in the plant together, on a finger and in its second form.

That each alone does what the catalogue says is in `test_plant.py`, over all effects.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.planted.physics.bench import GAIN
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.plant import Motion
from tests.planted.trials import jump, rows, run

Array = NDArray[np.float64]

TIME = rows(6.0)
STEPS = COMMANDS["steps"](np.random.default_rng(3), TIME.size)


def weak(causes: Causes, command: Array = STEPS) -> Motion:
    """The weak spring under random steps."""
    return run("spring_weak", causes, TIME[: command.size], command)


def test_a_log_starts_at_rest_however_the_motor_gives_way() -> None:
    """Under a command that stays nothing moves, whatever a motor lacks and all of it at once."""
    lack = {"saturation": 4.0, "sag": 0.05, "fade": 0.01}
    for causes in (*(Causes(**{name: size}) for name, size in lack.items()), Causes(**lack)):
        motion = weak(causes, np.full(80, 6.0))
        assert np.ptp(motion.angle) < 1.0e-6
        assert np.ptp(motion.force) < 1.0e-5


def test_the_second_form_of_the_plant_has_rounder_knees_and_bristles_that_slide_at_once() -> None:
    """Far from knees and edges both forms give the same, and near them they do not."""
    for causes in (Causes(saturation=4.0), Causes(deadband=0.2), Causes(coulomb=0.6)):
        first, second = weak(causes), weak(replace(causes, second_form=True))
        apart = np.abs(first.force - second.force)
        assert 0.01 < apart.max() < 0.4, causes
        assert np.median(apart) < 5e-3, causes  # a tenth of what a cell resolves


def test_bristles_of_the_second_form_hold_below_the_friction_and_slide_at_it() -> None:
    """A pull of 0.4 N against 1 N bends them in proportion."""
    time, causes = rows(4.0), Causes(coulomb=1.0, second_form=True)
    held = run("spring_weak", causes, time, jump(time, 2.0, 2.0 + 0.4 / GAIN))
    moved = held.coordinates[-1, 0] - held.coordinates[0, 0]
    assert moved == pytest.approx(0.4 * causes.bristle / 0.632, rel=0.05)
