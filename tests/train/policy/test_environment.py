"""The environment: what a policy sees, what it is paid for, and how episodes end."""

from typing import Any

import numpy as np
import pytest
import torch

from tendon_newton.data.cards.policy_observation import (
    ObservationHistory,
    applied_action,
    goal_angle,
    motor_command,
)
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.goal_path import GoalPath
from tests.train.policy.small import environment, random_actions


def test_the_policy_sees_what_deployment_builds_bit_for_bit() -> None:
    """Through clips, new goals and new episodes, a world at a time."""
    finger = environment()
    deployed = ObservationHistory(6)
    reading = finger.loop.reading

    def observe() -> np.ndarray:
        position, velocity = reading.motor_position[:, 0], reading.motor_velocity[:, 0]
        return deployed.observe(position.numpy(), velocity.numpy(), finger.goal.numpy())

    assert np.array_equal(observe(), finger.get_observations()["policy"].numpy())
    ended = 0
    for action in random_actions(60):
        seen, _, dones, _ = finger.step(action)
        deployed.act(applied_action(action.numpy()[:, 0], finger.config.action_clip))
        deployed.reset(dones.numpy())
        ended += int(dones.sum())
        assert np.array_equal(observe(), seen["policy"].numpy())
    assert ended > 12


def test_the_command_is_the_motor_angle_and_the_clipped_action_within_its_range() -> None:
    """theta_d = clip(theta + clip(a)); the ideal source pulls with 4.2 N/rad of the difference."""
    finger = environment(action_clip=1.0)
    before = finger.loop.reading.motor_position.clone()
    finger.step(torch.tensor([[0.0], [0.5], [5.0], [-5.0], [1.0], [-0.1]]))
    asked = before + torch.tensor([[0.0], [0.5], [1.0], [-1.0], [1.0], [-0.1]])
    pull = 4.2 * (asked.clamp(0.0, 2.0 * np.pi) - finger.loop.reading.motor_position)
    torch.testing.assert_close(  # float32 through 4.2 N/rad
        finger.loop.reading.force, pull.clamp(min=0.0), rtol=0.0, atol=2e-5
    )


@pytest.mark.parametrize(
    "finger", ["finger", pytest.param("finger_antagonist", marks=pytest.mark.slow)]
)
def test_commands_are_those_of_deployment_bit_for_bit(finger: str) -> None:
    """Range, pay-out rule and at most 4 rad a step, of one servo and of two with other angles."""
    worlds = environment(finger=finger, goals=(0.0, 1.8))
    low, high = np.array(worlds.command_ranges, np.float32).T
    home, wound_in = np.array(worlds.pay_outs, np.float32).T
    before = worlds.loop.reading.motor_position.numpy().copy()
    below = cut = 0
    for action in random_actions(40, worlds=6 * worlds.num_actions):
        asked = action.reshape(6, -1)
        position = worlds.loop.reading.motor_position.numpy().copy()
        applied = applied_action(asked.numpy(), worlds.config.action_clip)
        wanted = motor_command(position, applied, (low, high), (home, wound_in))
        expected = wanted.clip(before - 4.0, before + 4.0)
        _, _, dones, _ = worlds.step(asked)
        given = worlds.loop.solver.command.numpy().copy()
        assert np.array_equal(given[~dones.numpy()], expected[~dones.numpy()])
        standing = worlds.loop.reading.motor_position.numpy()
        before = np.where(dones.numpy()[:, None], standing, given)
        below += int((given < home).sum())
        cut += int((expected != wanted).sum())
    assert below > 10
    assert cut


def test_a_range_that_begins_at_home_has_no_pay_out_rule() -> None:
    """Nothing then lies below home, and the card gets no further key."""
    worlds = environment(command_range=(-0.4, 6.0), pay_out=(-0.4, 0.1))
    assert worlds.pay_outs == (None,)
    assert environment().pay_outs == ((0.0, 0.05),)


def test_a_goal_point_is_on_the_path_of_the_closing_finger_and_has_its_angle() -> None:
    """Statics without gravity and friction; the table is off by less than 10 um."""
    mechanism = load_mechanism("finger")
    path = GoalPath(mechanism)
    for tension in (0.0, 1.5, 4.0, 7.0):
        joints = equilibrium(mechanism, np.array([tension]), gravity=np.zeros(3))
        tip = tip_position(mechanism, joints)
        alpha = float(goal_angle(tip[0], tip[2]))
        point = path.points(torch.tensor([alpha]))[0].numpy()
        assert point == pytest.approx(tip, abs=1e-5)
    assert path.range[1] > 0.6 * np.pi


def test_goals_change_within_episodes_at_the_stated_rate() -> None:
    """0.1 per step, over 80 steps of 50 worlds: 400 changes, and 95 more or fewer by chance."""
    finger = environment(worlds=50, episode=100.0)
    changes, goal = 0, finger.goal.clone()
    for _ in range(80):
        finger.step(torch.zeros(50, 1))
        changes += int((finger.goal != goal).sum())
        goal = finger.goal.clone()
    assert 305 < changes < 495  # five standard deviations
    low, high = finger.config.goals
    assert bool(((goal >= low) & (goal <= high)).all())


def test_the_reward_is_that_of_the_goal_that_was_seen() -> None:
    """The distance to it at the end of the step, and how far the action changed."""
    finger = environment(goal_change=1.0, smooth_weight=0.01)
    for action in random_actions(5):
        goal, before = finger.goal.clone(), finger.history.action.clone()
        _, reward, dones, _ = finger.step(action)
        tip = finger.loop.reading.tip
        assert not dones.all()
        error = torch.linalg.vector_norm(finger.task.path.points(goal) - tip, dim=-1)
        change = (action.clip(-3.0, 3.0) - before).abs().sum(dim=-1)
        torch.testing.assert_close(reward[~dones], (-5.0 * error - 0.01 * change)[~dones])


def test_episodes_end_by_time_and_say_so() -> None:
    """Every 20 steps in each world, in groups at different times, as time-outs for rsl-rl."""
    finger = environment()
    ends = []
    for step in range(1, 41):
        _, _, dones, extras = finger.step(torch.zeros(6, 1))
        assert torch.equal(extras["time_outs"], dones.float())
        ends += [(step, world) for world in torch.nonzero(dones).ravel().tolist()]
        assert int(finger.episode_length_buf.max()) < 20
    assert [step for step, world in ends if world == 0] == [20, 40]
    assert [step for step, world in ends if world == 1] == [15, 35]
    assert len({step for step, _ in ends}) == 8


@pytest.mark.parametrize("poison", ["action", "number"])
def test_a_world_that_is_no_number_is_named_and_harms_no_other(poison: str) -> None:
    """It begins anew; what the others see, and draw later, stays the same to the last bit."""
    changes: dict[str, Any] = {"goal_change": 0.2, "randomise": ("link_mass", "spool_radius")}
    healthy, ill = environment(**changes), environment(**changes)
    others = [0, 1, 3, 4, 5]
    for step, action in enumerate(random_actions(45)):
        expected, reward, ends, _ = healthy.step(action)
        wrong = action.clone()
        if step == 4 and poison == "action":
            wrong[2] = torch.nan
        if step == 4 and poison == "number":
            ill.loop.bench_numbers("mass")[2] = torch.nan
        found, rewards, dones, extras = ill.step(wrong)
        assert torch.equal(dones[others], ends[others])
        assert step != 4 or bool(dones[2])
        assert bool(torch.isfinite(found["policy"]).all() & torch.isfinite(rewards).all())
        assert torch.equal(found["policy"][others], expected["policy"][others])
        assert torch.equal(rewards[others], reward[others])
        assert float(extras["log"]["/diverged_worlds"]) == float(step == 4)
    (fault,) = ill.divergences
    assert (fault.world, fault.step, ill.divergence_count) == (2, 5, 1)
    assert "world 2 diverged in step 5" in str(fault)
    assert not bool(ill.loop.reading.diverged.any())


def test_a_simulation_that_is_lost_stops() -> None:
    """Where most worlds are no numbers, learning would be on nothing."""
    finger = environment()
    with pytest.raises(SimulationDiverged, match="6 of 6 were not: world 5 diverged"):
        finger.step(torch.full((6, 1), torch.nan))


def test_the_same_seed_gives_the_same_worlds() -> None:
    """And another one gives others."""
    runs = [environment(seed, randomise=("joint_spring",)) for seed in (3, 3, 4)]
    for action in random_actions(25):
        seen = [run.step(action)[0]["policy"] for run in runs]
    assert torch.equal(seen[0], seen[1])
    assert not torch.equal(seen[0], seen[2])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"worlds": 0}, "worlds must be positive; it is 0"),
        ({"goals": (1.0, 0.5)}, "goals must be a least and a greatest angle"),
        ({"smooth_weight": -1.0}, "smooth_weight must not be negative"),
        ({"spread": 1.0}, "spread must be between 0 and 0.9"),
        ({"action_clip": float("nan")}, "action_clip must be positive"),
        ({"goals": (0.0, 3.0)}, "goals must be angles that this finger passes"),
        ({"finger": "spring_weak"}, "has 1 of them and no tip"),
    ],
)
def test_what_makes_no_sense_is_refused(changes: dict[str, Any], said: str) -> None:
    """In one sentence with the number that came."""
    with pytest.raises(InvalidParameter, match=said):
        environment(**changes)


def test_goals_are_refused_before_anything_is_simulated() -> None:
    """On a new bench kernels compile for half a minute, and then nothing can be learned."""
    config = EnvironmentConfig(worlds=2, goals=(0.0, 3.0))  # randomised: refused beside a simulator
    with pytest.raises(InvalidParameter, match="goals must be angles that this finger passes"):
        FingerEnvironment(config, simulator=object())
