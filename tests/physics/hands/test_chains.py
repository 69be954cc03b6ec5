"""The two sets of equations of motion say the same."""

import numpy as np
import pytest

from tendon_newton.simulation.hosts import rollout
from tests.physics.runs import ideal_model, run_of, simulate, stairs


def test_space_and_plane_give_the_same_finger(
    monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    """The general equations, told nothing of the plane, lead to the same motion."""
    runs = [run_of(stairs(rng, 81, 0.5, 3.0, 20))]
    planar = simulate(runs, ideal_model(), time_step=5e-4)[0]
    monkeypatch.setattr(rollout, "plane_of", lambda *_: None)
    spatial = simulate(runs, ideal_model(), time_step=5e-4)[0]
    # rounding of float64 over 2,000 steps
    assert spatial.joint_position == pytest.approx(planar.joint_position, abs=1e-10)
    assert spatial.force == pytest.approx(planar.force, abs=1e-8)
