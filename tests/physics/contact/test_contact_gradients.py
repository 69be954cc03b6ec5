"""Gradients of a rollout that touches things, against central differences."""

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.loading import load_mechanism
from tests.physics.contact.bodies import ball, block, floor
from tests.physics.gradients.test_gradients import check_gain_and_commands, check_numbers
from tests.physics.runs import ideal_model, run_of

pytestmark = pytest.mark.slow  # the quick tests of a ball are those beside links that meet
SCENE = (ball(), block(), floor())
NUMBERS = {
    "obstacle_position": ((0, 0, 2), (0, 0, 0), (1, 1, 2), (2, 2, 2)),
    "obstacle_size": ((0, 0, 0), (1, 1, 2)),
    "obstacle_stiffness": ((0, 0), (1, 1), (2, 2)),
    "obstacle_dissipation": ((0, 0), (1, 1), (2, 2)),
    "obstacle_friction": ((0, 0), (1, 1), (2, 2)),
    "capsule_radius": ((0, 0), (0, 1), (1, 1), (2, 1)),
    "stiffness": ((0, 0), (1, 1), (2, 0)),
    "mass": ((0, 1), (2, 0)),
    "arms": ((0, 0, 1), (1, 0, 0), (2, 0, 1)),
}
"""Numbers of three worlds, each with one obstacle: world, obstacle or link, and component."""
SIZES = {
    "obstacle_position": 0.02, "obstacle_size": 0.012, "obstacle_stiffness": 5e3,
    "obstacle_dissipation": 10.0, "obstacle_friction": 0.5, "capsule_radius": 4e-3,
    "stiffness": 0.03, "mass": 0.01, "arms": 0.005,
}  # fmt: skip
"""How large they are, in their units."""


def grasp() -> Array:
    """Return commands [rad] that press, slide, let go and press again."""
    return np.concatenate([np.full(10, 2.5), np.full(15, 3.2), np.full(10, 0.5), np.full(15, 3.5)])


@pytest.fixture(scope="module")
def rollout() -> DifferentiableRollout:
    """Return one world with a ball, one with a block, one with a floor, all from rest."""
    mechanism = load_mechanism("finger").with_obstacles(*SCENE)
    out = DifferentiableRollout(mechanism, [run_of(grasp())] * 3, ideal_model(), device="cpu")
    out.inputs.mechanism.obstacle_stiffness.assign(np.diag([5.0e3, 5.0e3, 5.0e3]))
    return out


def test_gradients_by_what_is_touched(rollout: DifferentiableRollout) -> None:
    """Place, size, material and friction of obstacles, and the finger that presses them."""
    check_numbers(rollout, NUMBERS, SIZES)


def test_gradients_by_gain_and_commands_of_a_held_object(rollout: DifferentiableRollout) -> None:
    """What the motor does while the finger holds something."""
    check_gain_and_commands(rollout, ((2, 0), (15, 0), (30, 0), (37, 0)))
