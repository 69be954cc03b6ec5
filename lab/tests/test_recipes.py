"""Recipes of studies are what pages tell users to type."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import tyro

from lab.studies.turning_seeds import RECIPE
from tendon_newton.cli.training.train_policy import TrainPolicyConfig


def test_the_page_has_the_command_of_the_hand_that_comes_along() -> None:
    """All settings are those of `turning_seeds`, with the windows that the page gives there."""
    page = Path("docs/policies.md").read_text(encoding="utf-8").replace("\\\n", "")
    (words,) = re.findall("^tendon-newton train-policy (--task turn .*)", page, re.MULTILINE)
    config = tyro.cli(TrainPolicyConfig, args=shlex.split(words)).training
    windows = re.search(r"turning_seeds .*--rate-window (\S+) --catch-up-time (\S+)", page)
    assert windows is not None
    turning = config.environment.turning
    assert [turning.rate_window, turning.catch_up_time] == list(map(float, windows.groups()))
    assert config == replace(RECIPE, environment=replace(RECIPE.environment, turning=turning))
