"""Our solver against Newton's SolverMuJoCo: two independent engines, one asset, one motion."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.mechanisms.asset_library import asset_names
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.mujoco.mujoco_rollout import MujocoRollout
from tests.physics.hands.chains import TREES, write_chain
from tests.physics.runs import ideal_model, run_of, simulate, stairs

STEP = 5.0e-4  # s
HOLDING = -0.3  # rad
WITHOUT_HANDS = [n for n in asset_names() if n != "servo" and not n.startswith("hand")]
COMMANDS = {"pendulum": (-0.1, 0.1)}
"""Commands that keep a bench off its stops [rad], where they are not those of the finger."""


def disagreement(mechanism: Mechanism, bench: str, lower: float, upper: float) -> float:
    """Return the greatest RMS difference of a joint as a share of the range it moves through."""
    rng = np.random.default_rng(1)
    # more than one recording: worlds of different length in one solver
    commands = [stairs(rng, rows, lower, upper, 40) for rows in (121, 81)]
    # a second tendon holds against the first
    held = [np.full((len(c), len(mechanism.tendons) - 1), HOLDING) for c in commands]
    runs = [
        run_of(np.column_stack([command, rest]), bench=bench)
        for command, rest in zip(commands, held, strict=True)
    ]
    ours = simulate(runs, ideal_model(), time_step=STEP, mechanism=mechanism)
    theirs = MujocoRollout(mechanism, runs, ideal_model(), time_step=STEP, device="cpu").run()
    shares = [
        np.sqrt(np.mean((a.joint_position - b.joint_position) ** 2, axis=0))
        / np.ptp(a.joint_position, axis=0)
        for a, b in zip(ours, theirs, strict=True)
    ]
    return float(np.max(shares))


# the servo's load is unknown: its bare horn is there to be looked at, and turned by positions
# alone; the hand is four of the routed fingers, and its twelve joints take a compiler minutes
@pytest.mark.parametrize("name", WITHOUT_HANDS)
def test_every_asset_moves_alike(name: str) -> None:
    """Without friction the trajectories agree to 1 % of the motion.

    MuJoCo's first-order steps leave about 0.2 %.
    """
    lower, upper = COMMANDS.get(name, (0.5, 2.5))
    assert disagreement(load_mechanism(name), name, lower, upper) < 0.01


@pytest.mark.parametrize("tree", TREES)
def test_chains_of_three_move_alike(tree: str, tmp_path: Path) -> None:
    """Three joints in a plane, with axes that are not parallel, and in a tree with two branches."""
    mechanism = load_mechanism(write_chain(tmp_path, tree))
    assert len(mechanism.joints) == 3
    assert disagreement(mechanism, "finger", 0.5, 2.0) < 0.01
