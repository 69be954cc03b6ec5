"""Another program's simulator as the worlds of a training."""

import re
import runpy
from pathlib import Path

import pytest

from tendon_newton.errors import InvalidParameter
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment


def test_another_simulator_s_worlds_are_all_alike() -> None:
    """What should differ between them is refused, in one line."""
    config = EnvironmentConfig(worlds=2, randomise=("link_mass",))
    with pytest.raises(InvalidParameter, match="link_mass"):
        FingerEnvironment(config, simulator=object())


EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "custom_training.py"


def test_the_example_of_an_own_training_loop_learns() -> None:
    """Evolution finds four numbers that cost less than half of what chance does."""
    train = runpy.run_path(str(EXAMPLE), run_name="example")["train"]
    policy, rewards = train(worlds=64, generations=12, steps=80)
    assert rewards[-1] > 0.5 * rewards[0]  # rewards are negative
    assert float(policy[1]) > 0.0  # a greater goal asks for more pull


def test_the_lines_of_the_documentation_run() -> None:
    """As they stand there, after the imports of the example."""
    text = (EXAMPLE.parents[1] / "docs" / "policies.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names = runpy.run_path(str(EXAMPLE), run_name="example")
    exec(block, names)
    assert names["seen"]["policy"].shape == (256, 150)
