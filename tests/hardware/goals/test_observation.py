"""The one definition of what a policy sees."""

import numpy as np
import pytest
import torch

from tendon_newton.data.cards.policy_observation import (
    HISTORY,
    SAMPLE,
    ObservationHistory,
    applied_action,
    goal_angle,
    motor_command,
    sample_of,
)
from tendon_newton.errors import InvalidParameter


def test_an_observation_is_thirty_samples_oldest_first() -> None:
    """Sample by sample, each with position, velocity, both last actions and goal."""
    history = ObservationHistory()
    for step in range(40):
        observation = history.observe([step], [10.0 * step], [0.5])
        history.act([0.1 * step])
    samples = observation.reshape(HISTORY, len(SAMPLE))
    assert observation.shape == (1, 150)
    assert observation.dtype == np.float32
    np.testing.assert_array_equal(samples[:, 0], np.arange(10, 40))
    np.testing.assert_array_equal(samples[:, 1], 10.0 * np.arange(10, 40))
    np.testing.assert_allclose(samples[:, 2], 0.1 * np.arange(9, 39), rtol=1e-6)  # float32
    np.testing.assert_allclose(samples[:, 3], 0.1 * np.arange(8, 38), rtol=1e-6)
    np.testing.assert_array_equal(samples[:, 4], 0.5)


def test_the_first_sample_fills_the_history() -> None:
    """Before the first step the finger is taken to have rested, with no action."""
    samples = ObservationHistory().observe([1.0], [0.0], [0.7]).reshape(HISTORY, len(SAMPLE))
    np.testing.assert_array_equal(samples, np.tile(samples[-1], (HISTORY, 1)))
    np.testing.assert_allclose(samples[-1], [1.0, 0.0, 0.0, 0.0, 0.7], rtol=1e-6)


def test_worlds_are_independent_and_reset_alone() -> None:
    """A world that is reset forgets its actions and its past; the others do not."""
    both, alone = ObservationHistory(2, 3), ObservationHistory(1, 3)
    for step in range(5):
        both.observe([step, step], [0.0, 0.0], [0.0, 0.0])
        both.act([1.0, 2.0])
    both.reset(np.array([True, False]))
    seen = both.observe([9.0, 9.0], [0.0, 0.0], [0.0, 0.0])
    np.testing.assert_array_equal(seen[0], alone.observe([9.0], [0.0], [0.0])[0])
    np.testing.assert_array_equal(seen[1].reshape(3, 5)[:, 0], [3.0, 4.0, 9.0])
    np.testing.assert_array_equal(seen[1].reshape(3, 5)[:, 2], [2.0, 2.0, 2.0])


def test_an_observation_does_not_change_afterwards() -> None:
    """What was handed out is a copy: later samples do not show in it."""
    history = ObservationHistory()
    first = history.observe([1.0], [0.0], [0.0])
    history.observe([2.0], [0.0], [0.0])
    assert first[0, -5] == 1.0


def test_numpy_and_torch_cut_alike() -> None:
    """Actions and commands come from the same functions in training and deployment."""
    output = np.array([-5.0, 0.3, 5.0], dtype=np.float32)
    position = np.array([0.1, 6.0, 6.0], dtype=np.float32)
    action = applied_action(output, 2.0)
    np.testing.assert_array_equal(action, np.float32([-2.0, 0.3, 2.0]))
    np.testing.assert_array_equal(applied_action(torch.from_numpy(output), 2.0).numpy(), action)
    command = motor_command(position, action, (0.0, 6.28))
    np.testing.assert_array_equal(command, np.float32([0.0, 6.3, 6.28]).clip(0, np.float32(6.28)))
    same = motor_command(torch.from_numpy(position), torch.from_numpy(action), (0.0, 6.28))
    np.testing.assert_array_equal(same.numpy(), command)


def test_the_goal_angle_is_that_of_the_contract() -> None:
    """Straight is 0, the tip below the PIP axis is pi/2."""
    assert goal_angle(0.055, 0.0) == 0.0
    assert goal_angle(0.0, -0.05) == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(("worlds", "history", "servos"), [(0, 30, 1), (1, 0, 1), (1, 30, 0)])
def test_an_empty_history_is_refused(worlds: int, history: int, servos: int) -> None:
    """No world, no sample, or no servo, is no observation."""
    with pytest.raises(InvalidParameter, match="1 or more"):
        ObservationHistory(worlds, history, servos)


def test_with_several_servos_each_number_stands_once_per_servo() -> None:
    """Angles, speeds, both last actions, each of all servos in their order, and one goal."""
    history = ObservationHistory(1, 2, 2)
    history.observe([[1.0, 2.0]], [[3.0, 4.0]], [0.5])
    history.act([[5.0, 6.0]])
    history.observe([[1.0, 2.0]], [[3.0, 4.0]], [0.5])
    history.act([[7.0, 8.0]])
    latest = history.observe([[1.0, 2.0]], [[3.0, 4.0]], [0.5])[0, -9:]
    np.testing.assert_array_equal(latest, [1.0, 2.0, 3.0, 4.0, 7.0, 8.0, 5.0, 6.0, 0.5])
    assert [name for name, _ in sample_of(2)] == [
        "theta_0",
        "theta_1",
        "theta_dot_0",
        "theta_dot_1",
        "action_0",
        "action_1",
        "previous_action_0",
        "previous_action_1",
        "alpha",
    ]
    assert sample_of(1) == SAMPLE
