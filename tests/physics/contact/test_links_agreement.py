"""Links that meet in our solver against MuJoCo."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.physics.contact.pinches import CROSSED, FACING, Place, pinch
from tests.physics.contact.test_contact_agreement import STIFF, Pair, moved_by_both
from tests.physics.runs import ideal_model, run_of, simulate

STEP = 2.5e-4  # s
SHORT_STEP = 1.0e-4  # s, with which MuJoCo's friction creeps less
OPEN = {FACING: (0.3, 0.5), CROSSED: (0.3, 0.3)}
PRESSED = {FACING: (2.0, 1.2), CROSSED: (2.0, 0.6)}
"""Commands [rad] with which two fingers are apart, and with which they press."""
MEETING, HELD = 24, 58
"""Rows in which they slide along each other, and in which both engines are at rest."""


def pressed(place: Place, folder: Path, *, friction: float, step: float) -> Pair:
    """Let both engines close two fingers on each other, hold them, and open again."""
    mechanism = pinch(folder, place, friction=friction, stiffness=STIFF)
    way = np.concatenate(
        [np.zeros(6), np.linspace(0.0, 1.0, 30), np.ones(24), np.linspace(1.0, 0.0, 20)]
    )
    start, end = np.array(OPEN[place]), np.array(PRESSED[place])
    command = start + way[:, None] * (end - start)
    return moved_by_both(mechanism, command, bench="pinch", step=step)


@pytest.mark.parametrize(
    "place", [FACING, pytest.param(CROSSED, marks=pytest.mark.slow)], ids=["facing", "crossed"]
)
def test_two_fingers_press_alike(place: Place, tmp_path: Path) -> None:
    """The same way in, the same hold, the same way out, and the same torques while it lasts."""
    pair = pressed(place, tmp_path, friction=0.0, step=STEP)
    assert np.all(pair.apart() < 0.003)  # MuJoCo's contact is linear in its damping
    torques = pair.held_torques(HELD)
    size = float(np.linalg.norm(torques[0]))
    assert size > 0.01  # N m
    assert np.min(np.abs(torques[0][[0, 2]])) > 1e-3  # on both fingers
    assert torques[1] == pytest.approx(torques[0], abs=5e-5 * size)


def test_two_fingers_slide_alike(tmp_path: Path) -> None:
    """One drags the other's link along as its friction says, and both come to rest there."""
    pair = pressed(FACING, tmp_path, friction=0.3, step=SHORT_STEP)
    sliding = slice(MEETING, HELD)
    # where ours sticks MuJoCo creeps
    assert np.all(pair.apart(sliding) < 0.01)
    torques = pair.held_torques(HELD)
    size = float(np.linalg.norm(torques[0]))
    assert torques[1] == pytest.approx(torques[0], abs=0.01 * size)
    (smooth,) = simulate(
        [run_of(pair.command, bench="pinch")],
        ideal_model(),
        time_step=SHORT_STEP,
        mechanism=pinch(tmp_path, FACING, friction=0.0, stiffness=STIFF),
    )
    slid = replace(pair, theirs=smooth.joint_position)
    assert np.max(slid.apart(sliding)) > 0.05  # friction decides where they are
