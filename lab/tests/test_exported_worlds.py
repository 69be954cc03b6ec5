"""Exported programs as the worlds of a training."""

from pathlib import Path

import pytest
import torch

from lab.studies.exported_worlds import ExportedWorlds
from tendon_newton.data.model_file import write_model
from tendon_newton.exports import EXPORTS
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment
from tests.exports.models import ANGLE, model_of

TIP = 1.0e-4  # m: what an encoder count moves the tip

STEPS = {"file": 5.0e-4, "program": 2.0e-4}  # s


@pytest.mark.parametrize("way", STEPS)
def test_an_exported_bench_is_a_training_s_finger(way: str, tmp_path: Path) -> None:
    """Under the same actions it moves as ours does, to an encoder count RMS, through resets."""
    model = model_of("finger", "pwm_servo", "coulomb_friction")
    mechanism = bench_of("finger", model)
    EXPORTS["mujoco"].write(tmp_path, mechanism, model)
    force = tmp_path / "model.toml"
    write_model(force, model)
    config = EnvironmentConfig(
        worlds=2, force=str(force), randomise=("none",), episode=0.4, max_step=2.0e-4
    )
    worlds = ExportedWorlds(
        tmp_path, mechanism, way, config.worlds, rate=config.rate, step=STEPS[way]
    )
    ours, theirs = FingerEnvironment(config), FingerEnvironment(config, simulator=worlds)
    ended = torch.zeros(2, dtype=torch.bool)
    angles, tips = [], []
    for action in torch.linspace(0.3, 2.0, 12):
        actions = torch.full((2, 1), float(action))
        (_, _, ends, _), _ = (each.step(actions) for each in (ours, theirs))
        ended |= ends.bool()
        here, there = ours.loop.reading, worlds.reading
        angles.append(here.motor_position - there.motor_position)
        tips.append(here.tip - there.tip)
    assert ended.all()
    assert float(torch.stack(angles).square().mean().sqrt()) < ANGLE
    assert float(torch.stack(tips).square().mean().sqrt()) < TIP
    worlds.close()
