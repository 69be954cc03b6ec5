"""Recipes of studies are what pages tell users to type."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest
import tyro

from lab.exams.rich import numbers_of, recipe_of
from lab.studies.diagnosed_policies import by_direction
from lab.studies.turning_seeds import RECIPE
from tendon_hardware.virtual_bench.emulation.truth import quasi_static_gear
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


def test_a_gear_pressed_from_both_sides_keeps_its_force_either_way() -> None:
    """((1 - s c_m) F_m - s C) / (1 + s c_e) at both signs of the speed, of a motor that pulls."""
    motor, load, dry, force = 0.3, 0.2, 1.4, 9.0
    mu, gain = quasi_static_gear(motor, load)
    middle = dry / (1.0 + motor * load)
    stribeck = {"coulomb_force": middle, "static_force": middle, "stribeck_velocity": 0.1}
    found = by_direction({"stribeck_friction": stribeck}, {"servo": {"motor_load_friction": motor}})
    for side, own in ((1.0, "winding"), (-1.0, "unwinding")):
        level = found["stribeck_friction"]["coulomb_force"] + found["asymmetric_friction"][own]
        left = (gain * force - side * level) / (1.0 + side * mu)
        exact = ((1.0 - side * motor) * force - side * dry) / (1.0 + side * load)
        assert left == pytest.approx(exact, rel=1e-12)


def test_no_two_causes_of_a_rich_bench_are_one_number_of_its_plant() -> None:
    """The second would take the first one's place, and its truth be wrong."""
    for number in range(100):
        _, draws, _ = recipe_of(number)
        assert len(numbers_of(*draws.values())) == sum(len(numbers_of(d)) for d in draws.values())
