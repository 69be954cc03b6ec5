"""No engine is timed that does not compute the motion."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lab.benchmarks import mechanics
from lab.benchmarks.engines_timed import soundness
from lab.benchmarks.engines_timed.engines import JOINT_FRICTION, FeatherstoneEngine, TendonEngine
from lab.benchmarks.engines_timed.native_mujoco import PlainMujocoEngine
from lab.benchmarks.engines_timed.soundness import ROWS, UnsoundEngine, judge, largest_sound, path
from lab.own_logs.__main__ import outcome, scored
from lab.own_logs.cases import CASES
from lab.own_logs.machines import one_body, position_servo

WORLDS = 8


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    """Return the path of fingers that rub, shape (T, W, J)."""
    return path(TendonEngine(WORLDS, 2.0e-4, "float64"))


def test_the_check_reaches_a_stop_and_sticks(reference: np.ndarray) -> None:
    """Otherwise it would not see an engine whose stops or friction fail."""
    (_, (_, stop)) = soundness.finger_limits()
    assert reference.shape == (ROWS, WORLDS, 2)
    assert reference[:, :, 1].max() > stop
    assert (np.abs(np.diff(reference, axis=0)) < 1.0e-6).mean() > 0.1


def test_a_diverging_engine_is_refused_and_never_timed(reference, monkeypatch) -> None:
    """Featherstone throws the links through their stops at 2 ms, as it is known to."""
    monkeypatch.setattr(soundness, "LADDER", (26,))
    monkeypatch.setattr(mechanics, "best_time", lambda *_: pytest.fail("it was timed"))
    make = partial(FeatherstoneEngine, friction=0.0)
    with pytest.raises(UnsoundEngine, match=r"8 worlds escaped"):
        mechanics.timed_when_sound("SolverFeatherstone", WORLDS, make, reference)


def test_an_engine_that_forgets_friction_is_refused(reference, monkeypatch) -> None:
    """It stays finite, and is 0.07 rad off."""
    monkeypatch.setattr(soundness, "LADDER", (50, 100))
    with pytest.raises(UnsoundEngine, match=r"1 ms: 0\.0\d+ rad, 0 worlds escaped; 0\.5 ms"):
        largest_sound("without friction", partial(TendonEngine, WORLDS, friction=0.0), reference)


def test_one_world_that_escapes_is_enough(reference: np.ndarray) -> None:
    """Neither NaN nor a joint far beyond its stop is averaged away."""
    for value in (np.nan, np.inf, -1.0e14, 3.0):
        found = reference.copy()
        found[ROWS // 2, 3, 1] = value
        verdict = judge(found, reference)
        assert verdict.escaped == 1
        assert not verdict.sound


def test_the_longest_sound_step_is_taken(reference, monkeypatch) -> None:
    """Shorter ones are not tried, and MuJoCo in C has the same motion as our solver."""
    monkeypatch.setattr(soundness, "LADDER", (6, 64, 100))
    make = partial(PlainMujocoEngine, WORLDS, friction=JOINT_FRICTION)
    engine, substeps, verdict = largest_sound("MuJoCo", make, reference)
    assert substeps == engine.substeps == 64
    assert verdict.sound
    assert verdict.error > 1.0e-3  # another engine, and not our own


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
def test_an_answer_is_right_by_name_and_number(name, value, alike, right, tmp_path) -> None:
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
