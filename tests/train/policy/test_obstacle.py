"""Something in the fingers' way: met where it was drawn, new with each episode, and not seen."""

import numpy as np
import pytest
import torch

from tendon_newton.errors import InvalidParameter
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.obstacle import SIZES
from tests.train.policy.small import environment

CLOSED = 2.9  # rad, an action that closes the finger


def close(finger: FingerEnvironment, steps: int) -> torch.Tensor:
    """Close all fingers, and return where their joints are, shape (steps, W, J)."""
    action = torch.full((finger.num_envs, 1), CLOSED)
    track = []
    for _ in range(steps):
        finger.step(action)
        track.append(finger.loop.reading.joint_position.clone())
    return torch.stack(track)


def test_an_obstacle_stops_the_finger() -> None:
    """Fingers with a ball in their way press against it; the others close as ever."""
    config = {
        "worlds": 24,
        "episode": 100.0,
        "randomise": ("none",),
        "goals": (0.3, 1.2),
        "max_step": 5e-4,
    }
    free = close(environment(**config), 30)[-1]
    finger = environment(**config, obstacle="sphere", obstacle_chance=0.5)
    there = finger.loop.bench_numbers("obstacle_stiffness")[:, 0] > 0.0
    assert 4 < int(there.sum()) < 20
    held = close(finger, 30)[-1]
    force = torch.linalg.vector_norm(finger.loop.contact_forces().sum(dim=(1, 2)), dim=-1)
    assert bool((force[there] > 0.05).all())  # N
    assert bool((force[there] < 10.0).all())  # what the tendon can press with
    assert bool((force[~there] == 0.0).all())
    assert bool(((held - free).abs().amax(dim=-1)[there] > 0.02).all())
    torch.testing.assert_close(held[~there], free[~there], rtol=0.0, atol=1e-5)


def test_an_open_finger_touches_nothing() -> None:
    """Boxes are drawn where the finger must move to meet them."""
    finger = environment(worlds=48, obstacle="box", obstacle_chance=1.0)
    there = finger.loop.bench_numbers("obstacle_stiffness")[:, 0] > 0.0
    assert int(there.sum()) > 40
    finger.loop.reset(torch.zeros(48, 1), joint_position=torch.zeros(48, 2))
    assert float(finger.loop.contact_forces().abs().max()) == 0.0


def test_an_obstacle_is_new_with_each_episode() -> None:
    """Place, size, stiffness and friction change for those that begin anew, within their ranges."""
    finger = environment(obstacle="sphere", obstacle_chance=1.0)
    names = ("position", "size", "stiffness", "friction")
    numbers = {name: finger.loop.bench_numbers(f"obstacle_{name}") for name in names}
    before = {name: values.clone() for name, values in numbers.items()}
    dones = torch.zeros(finger.num_envs, dtype=torch.bool)
    while not bool(dones.any()) or bool(dones.all()):
        _, _, dones, _ = finger.step(torch.zeros(finger.num_envs, 1))
    for name, values in numbers.items():
        changed = (values != before[name]).reshape(finger.num_envs, -1).any(dim=1)
        assert torch.equal(changed, dones), name
    radius = numbers["size"][:, 0, 0]
    assert bool(((radius >= SIZES[0]) & (radius <= SIZES[1])).all())


def test_a_policy_sees_no_more_than_before() -> None:
    """The observation has the same layout; what it says of the motion differs."""
    plain, finger = environment(), environment(obstacle="plane", obstacle_chance=1.0)
    seen = [env.get_observations()["policy"] for env in (plain, finger)]
    assert seen[0].shape == seen[1].shape
    assert not torch.equal(close(plain, 10), close(finger, 10))


def test_draws_come_from_the_seed() -> None:
    """The same seed, the same obstacles and the same motion."""
    tracks = [close(environment(obstacle="sphere"), 6).numpy() for _ in range(2)]
    assert np.array_equal(tracks[0], tracks[1])


def test_a_chance_is_between_zero_and_one() -> None:
    """Said before anything is built."""
    with pytest.raises(InvalidParameter, match="obstacle_chance"):
        environment(obstacle="sphere", obstacle_chance=1.5)
