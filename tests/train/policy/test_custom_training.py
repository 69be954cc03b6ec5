"""The public environment under a training loop that is not ours."""

import re
import runpy
from pathlib import Path

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
