"""Links that meet in our solver against SolverMuJoCo with Newton's collision pipeline."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.mujoco.mujoco_rollout import MujocoRollout
from tests.physics.contact.pinches import CROSSED, FACING, Place, pinch
from tests.physics.contact.test_contact_agreement import STIFF, held_torque
from tests.physics.runs import ideal_model, run_of, simulate

STEP = 2.5e-4  # s
SHORT_STEP = 1.0e-4  # s, with which MuJoCo's friction creeps less
OPEN = {FACING: (0.3, 0.5), CROSSED: (0.3, 0.3)}
PRESSED = {FACING: (2.0, 1.2), CROSSED: (2.0, 0.6)}
"""Commands [rad] with which two fingers are apart, and with which they press."""
MEETING, HELD = 24, 58
"""Rows in which they slide along each other, and in which both engines are at rest."""


def closing_pair(
    place: Place, folder: Path, *, friction: float, step: float
) -> tuple[Mechanism, Trajectory, Trajectory]:
    """Let both engines close two fingers on each other, hold them, and open again."""
    mechanism = pinch(folder, place, friction=friction, stiffness=STIFF)
    way = np.concatenate(
        [np.zeros(6), np.linspace(0.0, 1.0, 30), np.ones(24), np.linspace(1.0, 0.0, 20)]
    )
    start, end = np.array(OPEN[place]), np.array(PRESSED[place])
    runs = [run_of(start + way[:, None] * (end - start), bench="pinch")]
    (ours,) = simulate(runs, ideal_model(), time_step=step, mechanism=mechanism)
    rollout = MujocoRollout(mechanism, runs, ideal_model(), time_step=step, device="cpu")
    (theirs,) = rollout.run()
    return mechanism, ours, theirs


def apart(ours: Trajectory, theirs: Trajectory, rows: slice = slice(None)) -> Array:
    """Return how far two motions are apart (RMS), as a share of each joint's way [1], (J,)."""
    reach = np.ptp(ours.joint_position, axis=0)
    errors = (ours.joint_position - theirs.joint_position)[rows]
    return np.sqrt(np.mean(errors**2, axis=0)) / reach


@pytest.mark.parametrize(
    "place", [FACING, pytest.param(CROSSED, marks=pytest.mark.slow)], ids=["facing", "crossed"]
)
def test_two_fingers_press_alike(place: Place, tmp_path: Path) -> None:
    """The same way in, the same hold, the same way out, and the same torques while it lasts."""
    mechanism, ours, theirs = closing_pair(place, tmp_path, friction=0.0, step=STEP)
    assert np.all(apart(ours, theirs) < 0.003)  # MuJoCo's contact is linear in its damping
    torques = [held_torque(mechanism, run, HELD) for run in (ours, theirs)]
    size = float(np.linalg.norm(torques[0]))
    assert size > 0.01  # N m
    assert np.min(np.abs(torques[0][[0, 2]])) > 1e-3  # on both fingers
    assert torques[1] == pytest.approx(torques[0], abs=5e-5 * size)


def test_two_fingers_slide_alike(tmp_path: Path) -> None:
    """One drags the other's link along as its friction says, and both come to rest there."""
    mechanism, ours, theirs = closing_pair(FACING, tmp_path, friction=0.3, step=SHORT_STEP)
    sliding = slice(MEETING, HELD)
    # where ours sticks MuJoCo creeps
    assert np.all(apart(ours, theirs, sliding) < 0.01)
    torques = [held_torque(mechanism, run, HELD) for run in (ours, theirs)]
    size = float(np.linalg.norm(torques[0]))
    assert torques[1] == pytest.approx(torques[0], abs=0.01 * size)
    _, smooth, _ = closing_pair(FACING, tmp_path, friction=0.0, step=SHORT_STEP)
    assert np.max(apart(ours, smooth, sliding)) > 0.05  # friction decides where they are
