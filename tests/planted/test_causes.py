"""What causes do in the plant together, on a finger and in its second form.

That each alone does what the catalogue says is in `test_plant.py`, over all effects.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.planted.physics.bench import GAIN, GRAVITY, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.plant import Motion
from tests.planted.trials import FROZEN, WEAK, jump, rows, run

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


def test_friction_keeps_a_loosening_tendon_taut() -> None:
    """Tension is held, and the tendon taut, while the command is already below the angle."""
    motion = weak(Causes(slack=0.002, coulomb=0.8, viscous=1.5))
    held = (motion.force > 0.0) & (motion.angle > STEPS + 0.1)
    assert np.count_nonzero(held) > 5
    taut = (motion.coordinates[:, 0] + 0.002) / SPOOL_RADIUS
    assert motion.angle[held] == pytest.approx(taut[held], abs=1e-9)


def test_viscous_friction_and_a_stretching_tendon_make_a_lag() -> None:
    """With the mechanism frozen the force relaxes with b / (r k) / (1 + P / (r k))."""
    time = rows(1.0)
    causes = Causes(compliance=1.0 / 4e3, viscous=1.5, inertia_scale=FROZEN)
    motion = run("spring_weak", causes, time, jump(time, 2.0, 3.0))
    slope = GAIN / SPOOL_RADIUS / 4e3
    constant = 1.5 / SPOOL_RADIUS / 4e3 / (1.0 + slope)
    way = 1.0 - np.exp(-np.maximum(time - 0.5, 0.0) / constant)
    expected = GAIN / (1.0 + slope) * way
    assert motion.force - motion.force[0] == pytest.approx(expected, abs=4e-3)  # one step of lead


def test_inertia_does_not_change_the_weight() -> None:
    """A finger of fourfold inertia hangs where the nominal one does."""
    time = rows(0.2)
    heavy, nominal = (
        run("finger", Causes(inertia_scale=scale), time, np.full(time.size, 1.5))
        for scale in (4.0, 1.0)
    )
    assert heavy.coordinates == pytest.approx(nominal.coordinates, abs=1e-9)


def test_tilting_downward_helps_the_tendon() -> None:
    """A rail tipped by an angle carries m g sin(angle); a finger tipped by 90 degrees hangs."""
    motion = weak(Causes(tilt=0.4), np.full(40, 2.0))
    weight, stiffness = WEAK.mass[0] * GRAVITY * np.sin(0.4), WEAK.stiffness[0]
    assert motion.force + weight == pytest.approx(stiffness * motion.coordinates[:, 0], abs=1e-6)
    time = rows(0.1)
    hanging = run("finger", Causes(tilt=np.pi / 2.0), time, np.zeros(time.size))
    assert hanging.coordinates == pytest.approx(0.0, abs=1e-6)
    level = run("finger", Causes(), time, np.zeros(time.size))
    assert level.coordinates.min() > 0.03


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
