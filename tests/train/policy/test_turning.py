"""Hands that turn a ball: the cup, the environment's new parts, a training and its evaluation."""

from dataclasses import replace
from typing import Any

import pytest
import torch

from tendon_newton.cli import main
from tendon_newton.data.cards.policy_observation import sample_of
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.turning import Turning

pytestmark = pytest.mark.slow  # a hand's kernels take a minute to compile

WORLDS = 6
PLAIN = TurningConfig(
    turn_rates=(1.0, 1.0),
    start_command=1.0,
    size_spread=0.0,
    camera_noise=(0.0, 0.0),
    camera_delay=(1, 1),
)
HANDS = EnvironmentConfig(
    task="turn",
    worlds=WORLDS,
    randomise=("none",),
    spread=0.0,
    max_step=2.0e-3,
    history=3,
    episode=1000.0,
    turning=PLAIN,
)


def hands(**changes: Any) -> tuple[FingerEnvironment, Turning]:
    """Return hands that are alike, and their task."""
    environment = FingerEnvironment(replace(HANDS, **changes))
    assert isinstance(environment.task, Turning)
    return environment, environment.task


def test_the_ball_rests_in_its_cup_below_open_fingers() -> None:
    """Two seconds under open fingers move its middle by less than 0.2 mm, and no link touches."""
    environment, task = hands()
    for _ in range(40):
        environment.loop.step(torch.zeros(WORLDS, 4))
    moved = environment.loop.body_pose[:, :3] - torch.tensor([-0.003, 0.0, -0.040])
    assert float(moved.norm(dim=-1).max()) < 2e-4
    assert float(environment.loop.body_velocity.abs().max()) < 1e-4
    assert float(environment.loop.contact_forces().abs().max()) == 0.0
    assert task.goal.tolist() == [1.0] * WORLDS


def test_a_camera_shows_where_the_ball_was_a_step_ago() -> None:
    """The last three numbers of a sample; the first ones are the servos'."""
    environment, task = hands()
    before, farthest = torch.zeros(WORLDS, 3), 0.0
    for step in range(12):
        seen = environment.step(torch.full((WORLDS, 4), 2.0 if step < 6 else -2.0))[0]["policy"]
        latest = seen.reshape(WORLDS, 3, -1)[:, -1]
        assert latest.shape[1] == len(sample_of(4, "turn"))
        assert torch.equal(latest[:, :4], environment.loop.reading.motor_position)
        assert torch.equal(latest[:, -5], task.goal)
        assert torch.equal(latest[:, -3:], before)
        before = task.judged_pose[:, :3].clone()
        farthest = max(farthest, float(before.abs().max()))
    assert farthest > 2e-4  # closing fingers have pressed the ball


def test_a_drop_costs_its_price_and_ends_the_episode_for_good() -> None:
    """A ball that is lifted out of the cup: no time-out, and the next one lies in the cup."""
    environment, _ = hands(smooth_weight=0.0)
    environment.loop.body_pose[2, 2] -= 0.03
    seen, reward, dones, extras = environment.step(torch.zeros(WORLDS, 4))
    assert dones.tolist() == [world == 2 for world in range(WORLDS)]
    assert extras["time_outs"].sum() == 0.0
    late = 1.0 / environment.loop.rate / PLAIN.catch_up_time  # [rad/s]: the balls lie still
    assert reward[:2].tolist() == pytest.approx([-late] * 2, abs=0.01)
    expected = -PLAIN.drop_price - PLAIN.place_weight * PLAIN.drop_distance - late
    assert float(reward[2]) == pytest.approx(expected, abs=0.01)
    assert float(environment.loop.body_pose[2, 2]) == pytest.approx(-0.040, abs=1e-6)
    assert float(seen["policy"][2].reshape(3, -1)[:, -3:].abs().max()) == 0.0


def test_a_policy_that_turns_is_trained_written_and_watched(tmp_path, capsys) -> None:
    """Two rounds of PPO; the card says what it is for, and evaluate-policy what the balls did."""
    config = PolicyTrainingConfig(
        environment=replace(HANDS, turning=TurningConfig()),
        iterations=2,
        steps=4,
        batch=12,
        checkpoint_every=1,
        hidden=(16,),
    )
    trained = train_policy(config, tmp_path, report=lambda progress: None)
    assert set(trained.points[-1].figures) == {"turning_rate", "displacement", "drops_per_minute"}
    again = train_policy(config, tmp_path, report=lambda progress: None)
    assert again.points == trained.points
    exported = export_policy(tmp_path, trained, config)
    assert exported.card.turning.asset == exported.card.training.finger == "hand_ball"
    out = tmp_path / "comparison"
    words = ["evaluate-policy", str(exported.onnx), "--out", str(out), "--worlds", "2"]
    assert main([*words, "--seconds", "0.1"]) == 0
    assert "rad/min" in capsys.readouterr().out
    assert (out / "evaluation.json").exists()
