"""Gradients of a rollout in which links meet, and a ball, against central differences."""

import numpy as np
import pytest
import torch

from tendon_newton.data.recording import Array, Recording
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.trajectory_gradient import simulate_with_gradients
from tests.physics.contact.bodies import ball
from tests.physics.contact.pinches import pinch
from tests.physics.gradients.test_gradients import check_gain_and_commands, check_numbers
from tests.physics.runs import ideal_model, run_of

NUMBERS = {
    "obstacle_stiffness": ((0, 1), (1, 1)), "obstacle_dissipation": ((0, 1), (1, 1)),
    "obstacle_friction": ((0, 1), (1, 1)), "capsule_radius": ((0, 1), (0, 2), (1, 1)),
    "stiffness": ((0, 0), (0, 2), (1, 3)), "mass": ((0, 1), (1, 2)), "arms": ((0, 0, 1), (1, 1, 2)),
}  # fmt: skip
"""Numbers of two worlds: world, obstacle, capsule or joint, and component."""
SIZES = {
    "obstacle_stiffness": 5e3, "obstacle_dissipation": 10.0, "obstacle_friction": 0.3,
    "capsule_radius": 4e-3, "stiffness": 0.03, "mass": 0.01, "arms": 0.005,
}  # fmt: skip
"""How large they are, in their units."""


def closing(open_at: Array, press_at: Array) -> Recording:
    """Return commands [rad] that press, slide, let go a little and press again."""
    way = np.concatenate(
        [
            np.zeros(4),
            np.linspace(0.0, 1.0, 12),
            np.ones(10),
            np.linspace(1.0, 0.2, 8),
            np.linspace(0.2, 1.0, 8),
        ]
    )
    return run_of(open_at + way[:, None] * (press_at - open_at), bench="pinch")


@pytest.fixture(scope="module")
def rollout(tmp_path_factory: pytest.TempPathFactory) -> DifferentiableRollout:
    """Return two worlds of two fingers that press and slide, and a ball that is not there."""
    fingers = pinch(tmp_path_factory.mktemp("pinch"), friction=0.3)
    mechanism = fingers.with_obstacles(ball(stiffness=0.0))
    runs = [
        closing(np.array([0.3, 0.5]), np.array([2.0, 1.2])),
        closing(np.array([0.5, 0.9]), np.array([1.5, 1.0])),
    ]
    return DifferentiableRollout(mechanism, runs, ideal_model(), device="cpu")


def test_gradients_by_gain_and_commands_of_pressed_fingers(rollout: DifferentiableRollout) -> None:
    """What either motor does, while both fingers feel it."""
    check_gain_and_commands(rollout, ((12, 0), (12, 1), (30, 0), (30, 1)))


@pytest.mark.slow
def test_gradients_by_links_that_meet(rollout: DifferentiableRollout) -> None:
    """Material of the contact, radii of both links, and the fingers that press."""
    check_numbers(rollout, NUMBERS, SIZES)


def test_torch_moves_an_obstacle_out_of_the_way(rollout: DifferentiableRollout) -> None:
    """The place of an obstacle is an input of a torch program: along its slope the loss falls.

    By as much as the slope says, to a twentieth.
    """
    numbers = rollout.inputs.mechanism
    place, stiffness = numbers.obstacle_position.numpy(), numbers.obstacle_stiffness.numpy()
    numbers.obstacle_stiffness.fill_(stiffness.max())
    position, step, losses = torch.tensor(place, requires_grad=True), 1.0e-6, []  # m
    for _ in range(2):
        tracks = simulate_with_gradients(rollout, obstacle_position=position)
        loss = (tracks.joint_position**2).mean()
        position.grad = None
        loss.backward()
        losses.append(loss.item())
        slope = position.grad.norm()
        with torch.no_grad():
            position -= step * position.grad / slope
    assert losses[0] - losses[1] == pytest.approx(step * slope.item(), rel=0.05)
    numbers.obstacle_position.assign(place)
    numbers.obstacle_stiffness.assign(stiffness)
