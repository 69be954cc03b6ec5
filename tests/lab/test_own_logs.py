"""The strangers' machines obey what a text book says, and their answers are scored strictly."""

import json
from pathlib import Path

import numpy as np
import pytest

from lab.own_logs.__main__ import outcome, scored
from lab.own_logs.cases import CASES
from lab.own_logs.machines import one_body, position_servo

TRUTH = {"coulomb_friction": {"force": 0.9}}


def test_dry_friction_holds_a_body_until_it_is_overcome() -> None:
    """29 N against 30 N move nothing and nothing is left of them; 31 N move it."""
    for force, moves in ((29.0, False), (31.0, True)):
        goal = np.full(50, force / 100.0)
        travel, left = one_body(goal, 0.01, 100.0, 1.0, lambda *_: 0.0, lambda *_: 30.0)
        assert bool(travel[-1] > 0.0) is moves
        assert moves or not left.any()


def test_a_servo_that_plays_and_lags_ends_half_its_play_short() -> None:
    """One way; a steady ramp of 1 rad/s is followed by delay and lag later."""
    ramp = 0.02 * np.arange(200)
    late = ramp[-1] - position_servo(ramp, 0.02, delay=0.04, lag=0.06)[-1]
    assert late == pytest.approx(0.10 + 0.01, abs=0.011)  # a held command: half a row
    assert position_servo(np.r_[0.0, np.ones(99)], 0.02, play=0.1)[-1] == pytest.approx(0.95)


@pytest.mark.parametrize(
    ("name", "value", "alike", "right"),
    [
        ("coulomb_friction", 0.95, [], True),
        ("coulomb_friction", 1.1, [], False),
        ("viscous_friction", 0.9, [], False),
        ("viscous_friction", 0.9, ["coulomb_friction"], True),
    ],
)
def test_an_answer_is_right_by_name_and_number(
    name: str, value: float, alike: list[str], right: bool, tmp_path: Path
) -> None:
    """Its own name within a tenth or inside the interval, or a class that holds the name."""
    number = {"value": value, "ci95": [value - 0.01, value + 0.01]}
    effect = {"name": name, "parameters": {"force": number}, "indistinguishable_from": alike}
    errors = {"theta_rmse": 0.1, "force_rmse": None}
    path = tmp_path / "diagnosis.json"
    said = {"effects": [effect], "verdict": "explained", "baseline": errors, "extended": errors}
    path.write_text(json.dumps(said))
    assert scored(path, TRUTH)["right"] is right
    path.write_text(json.dumps({**said, "effects": [effect, {**effect, "name": "backlash"}]}))
    assert scored(path, TRUTH)["right"] is False


@pytest.mark.slow
def test_the_gear_of_a_strangers_arm_is_found_by_the_documented_commands(tmp_path: Path) -> None:
    """From CSV files to gear_load_friction of 0.12, and nothing else."""
    found = outcome(CASES["geared_arm"], tmp_path)["diagnoses"]["diagnosis"]
    assert found["right"], found
