"""Training: what stays, what goes on, and that the finger learns."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensordict import TensorDict

from tendon_newton.errors import InvalidOutput, InvalidParameter, InvalidPolicyFile
from tendon_train.policy.config.policy_training_config import (
    OBSERVED,
    PolicyTrainingConfig,
    exploration_at,
    learning_rate_at,
    to_rsl_rl,
)
from tendon_train.policy.runs.curve import CurvePoint, Progress
from tendon_train.policy.runs.kept_noise import KeptNoise
from tendon_train.policy.runs.policy_export import PolicyNetwork
from tendon_train.policy.runs.policy_training import Trained, train_policy
from tendon_train.policy.runs.training_process import Process
from tests.faults.outside import full_disk
from tests.train.policy.small import environment, random_actions, short_training


def train(config: PolicyTrainingConfig, out: Path) -> Trained:
    """Train without a word."""
    return train_policy(config, out, report=lambda progress: None)


def weights(trained: Trained) -> dict[str, torch.Tensor]:
    """Return everything that was learned, and the optimiser's memory of it."""
    table = trained.runner.alg.save()
    return {
        f"{part}.{name}": value
        for part in ("actor_state_dict", "critic_state_dict")
        for name, value in table[part].items()
    }


def test_the_given_deviation_gets_no_gradient_and_stays(tmp_path: Path) -> None:
    """To the last bit, while every other number of the actor moves."""
    config = short_training(exploration=0.3)
    start = weights(train(replace(config, iterations=1), tmp_path / "one"))
    trained = train(config, tmp_path / "all")
    end = weights(trained)
    actor = trained.runner.alg.get_policy()
    (deviation,) = (p for n, p in actor.named_parameters() if "std" in n)
    assert (deviation.requires_grad, deviation.grad) == (False, None)
    assert torch.equal(deviation, torch.full_like(deviation, 0.3))
    learned = [name for name in start if "mlp" in name]
    assert len(learned) == 16
    assert not any(torch.equal(start[name], end[name]) for name in learned)


def test_exploration_and_learning_rate_fall_from_iteration_to_iteration(tmp_path: Path) -> None:
    """As the number of iterations done says, so that a training that goes on learns alike."""
    config = short_training(exploration=0.5, exploration_end=0.1, learning_rate_end=1e-4)
    assert exploration_at(config, 0) == pytest.approx(0.5)
    assert exploration_at(config, config.iterations) == pytest.approx(0.1)
    algorithm = train(config, tmp_path).runner.alg
    (deviation,) = (p for n, p in algorithm.get_policy().named_parameters() if "std" in n)
    last = config.iterations - 1
    assert float(deviation.detach()) == pytest.approx(exploration_at(config, last))
    rate = 5e-4 + 0.75 * (1e-4 - 5e-4)  # after three of four iterations
    assert learning_rate_at(config, last) == pytest.approx(rate)
    assert algorithm.optimizer.param_groups[0]["lr"] == pytest.approx(rate)


def test_noise_that_is_kept_has_its_deviation_in_each_step() -> None:
    """Of 0.8 a step keeps 0.8 of the last one's and 0.64 of that before; learning moves nothing."""
    distribution = KeptNoise(2, 0.8, init_std=3.0, learn_std=False)
    torch.manual_seed(0)
    distribution.update(torch.ones(20_000, 2))
    with torch.inference_mode():
        first, second = distribution.sample(), distribution.sample()
    distribution.sample()
    with torch.inference_mode():
        third = distribution.sample()
    noise = torch.stack([each.ravel() - 1.0 for each in (first, second, third)])
    torch.testing.assert_close(noise.std(dim=1), torch.full((3,), 3.0), rtol=0.02, atol=0.0)
    shares = torch.corrcoef(noise)[0, 1:]
    torch.testing.assert_close(shares, torch.tensor([0.8, 0.64]), rtol=0.0, atol=0.02)


def test_a_memory_of_all_noise_is_refused() -> None:
    """Nothing would be new."""
    with pytest.raises(InvalidParameter, match="exploration_memory must be from 0 to below 1; it"):
        PolicyTrainingConfig(exploration_memory=1.0)


def test_a_larger_unit_of_action_changes_what_outputs_mean_and_no_more(tmp_path: Path) -> None:
    """Half the outputs in units of 2 rad act alike, explore alike, and leave as radians."""
    plain, coarse = environment(), environment(action_unit=2.0)
    for action in random_actions(4):
        assert torch.equal(plain.step(action)[1], coarse.step(0.5 * action)[1])
    config = short_training(iterations=1, exploration=0.5, action_unit=2.0)
    actor = train(config, tmp_path).runner.alg.get_policy()
    assert float(actor.distribution.std_param.detach()) == 0.25
    seen = TensorDict({OBSERVED: torch.randn(5, 150)}, batch_size=[5])
    assert torch.allclose(PolicyNetwork(actor, 2.0)(seen[OBSERVED]), 2.0 * actor(seen))


def test_actor_and_critic_have_the_layers_of_the_paper(tmp_path: Path) -> None:
    """150-128-64-32-1 with ReLU."""
    trained = train(short_training(iterations=1), tmp_path)
    layers = list(trained.runner.alg.get_policy().mlp)
    linear = [layer for layer in layers if isinstance(layer, torch.nn.Linear)]
    assert [layer.in_features for layer in linear] == [150, 128, 64, 32]
    assert linear[-1].out_features == 1
    assert [type(layer).__name__ for layer in layers[1::2]] == ["ReLU"] * 3


def test_a_training_that_goes_on_is_the_one_that_was_not_interrupted(tmp_path: Path) -> None:
    """The same curve and the same weights, to the last bit."""
    config = short_training()
    whole = train(config, tmp_path / "whole")
    train(replace(config, iterations=2), tmp_path / "parts")
    shown: list[Progress] = []
    parts = train_policy(config, tmp_path / "parts", report=shown.append)
    assert [progress.point.iteration for progress in shown] == [3, 4]
    assert parts.points == whole.points
    assert [point.samples for point in parts.points] == [96, 192, 288, 384]
    expected, found = weights(whole), weights(parts)
    assert all(torch.equal(found[name], value) for name, value in expected.items())


def test_a_finished_training_is_not_done_again(tmp_path: Path) -> None:
    """It comes back as it was."""
    config = short_training(iterations=2)
    first = train(config, tmp_path)
    again = train_policy(config, tmp_path, report=lambda progress: pytest.fail("it was finished"))
    assert again.points == first.points
    assert torch.equal(
        weights(again)["actor_state_dict.mlp.0.weight"],
        weights(first)["actor_state_dict.mlp.0.weight"],
    )


def test_a_checkpoint_of_another_training_is_refused(tmp_path: Path) -> None:
    """The message names what differs; a damaged file is one too."""
    config = short_training(iterations=2)
    train(config, tmp_path)
    with pytest.raises(InvalidPolicyFile, match="seed = 0, and now it is 5"):
        train(replace(config, seed=5), tmp_path)
    worlds = replace(config.environment, goal_weight=2.0)
    with pytest.raises(InvalidPolicyFile, match=r"goal_weight = 5.0, and now it is 2.0"):
        train(replace(config, environment=worlds), tmp_path)
    (file,) = (tmp_path / "checkpoints").glob("*.pt")
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(InvalidPolicyFile, match=r"000002\.pt: the checkpoint of a training"):
        train(config, tmp_path)


def test_a_full_disk_ends_a_training_in_words(tmp_path: Path) -> None:
    """The error names the checkpoint, and no half of one is left."""
    with full_disk(20_000), pytest.raises(InvalidOutput, match=r"000002\.pt: cannot be written"):
        train(short_training(iterations=2), tmp_path)
    assert not list((tmp_path / "checkpoints").iterdir())


def test_a_world_that_diverges_does_not_reach_the_weights(tmp_path: Path) -> None:
    """A force that is no number in one world of twelve: it is counted, and learning goes on."""
    trained = train(short_training(iterations=1), tmp_path)
    finger = trained.environment
    finger.loop.numbers("ideal", "gain")[7] = torch.nan  # nothing draws it anew
    trained.runner.learn(1)
    point: CurvePoint = trained.runner.logger.points[-1]
    assert point.diverged == 8  # in each of the eight steps
    assert {fault.world for fault in finger.divergences} == {7}
    assert all(bool(torch.isfinite(value).all()) for value in weights(trained).values())


def test_rewards_of_episodes_that_end_by_time_are_continued(tmp_path: Path) -> None:
    """rsl-rl adds the critic's value to the reward of a step that the clock ended."""
    trained = train(short_training(iterations=1), tmp_path)
    algorithm, finger = trained.runner.alg, trained.environment
    finger.episode_length_buf.fill_(finger.max_episode_length - 1)
    with torch.inference_mode():
        actions = algorithm.act(finger.get_observations())
        value = algorithm.transition.values.clone()[:, 0]
        seen, reward, dones, extras = finger.step(actions)
        algorithm.process_env_step(seen, reward, dones, extras)
    assert bool(dones.all())
    stored = algorithm.storage.rewards[0][:, 0]
    torch.testing.assert_close(stored, reward + 0.95 * value)


def test_batches_divide_an_iteration() -> None:
    """The authors' 4096 worlds, 128 steps and 1024 steps a batch are 512 updates."""
    table = to_rsl_rl(PolicyTrainingConfig())
    assert table["algorithm"]["num_mini_batches"] == 512
    assert table["actor"]["distribution_cfg"]["learn_std"] is False


def test_several_processes_need_a_gpu_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has its own GPU and its own draws; on a CPU they are refused."""
    for name, value in (("RANK", "3"), ("LOCAL_RANK", "1"), ("WORLD_SIZE", "4")):
        monkeypatch.setenv(name, value)
    process = Process.own()
    assert process == Process(rank=3, local_rank=1, count=4)
    with pytest.raises(InvalidParameter, match="4 processes need a GPU each"):
        process.device("cpu")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert process.device("cuda") == "cuda:1"
    alone = Process(rank=0, local_rank=0, count=1)
    assert alone.seed_draws(0, 5) != process.seed_draws(0, 5)
    assert alone.seed_draws(0, 5) == alone.seed_draws(0, 5)
    with pytest.raises(InvalidParameter, match="device must be cpu, cuda or auto; it is 'gpu'"):
        alone.device("gpu")


def test_the_environment_is_what_a_config_says() -> None:
    """rsl-rl reads these; 20 Hz for a second are 20 steps."""
    finger = environment()
    assert (finger.num_envs, finger.num_actions, finger.max_episode_length) == (6, 1, 20)
    assert finger.get_observations()["policy"].shape == (6, 150)
