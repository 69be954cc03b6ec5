"""What no effect explains is looked at by a learner that stays silent on noise."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.identifiability import find_confounded, is_flat
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.diagnosis.unexplained.remainder import Remainder, find_remainders
from tendon_newton.diagnosis.unexplained.remainder_structure import (
    LEAST_R2,
    RemainderStructure,
    find_structure,
    look,
)
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.linearisation import Linearisation
from tendon_newton.identification.study import Study
from tests.planted.generator import Recipe, make_dataset

SHORT = (5.0, 6.0)  # [s] of each recording


def planted(folder: Path, *effects: str, seed: int, **more: Any) -> Study:
    """The training recordings of a planted dataset beside its starting model."""
    recipe = Recipe(effects=effects, seed=seed, mix="W", duration=SHORT, **more)
    make_dataset(folder, recipe)
    model = load_model(folder / "model.toml")
    recordings = load_dataset(folder).train
    return Study(recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_learner_is_silent_on_a_right_model(seed: int, tmp_path: Path) -> None:
    """Slow and medium noise; the second servo has the dry friction that its model knows."""
    study = planted(
        tmp_path, seed=seed, noise_colour=(0.0, 0.9, 0.6)[seed], known_friction=seed == 2
    )
    seen = find_structure(study, {})
    assert not seen.found
    assert seen.held_out_r2 < LEAST_R2
    assert seen.depends_on == ()


@pytest.mark.parametrize("effect", ["periodic_cogging", "dead_spot"])
def test_what_sits_at_an_angle_is_seen_there(effect: str, tmp_path: Path) -> None:
    """Servo side, the motor angle first; most of a ripple, and a dead spot where it is."""
    seen = find_structure(planted(tmp_path, effect, seed=4), {})
    assert (seen.found, seen.side, seen.depends_on[0]) == (True, "servo", "theta")
    if effect == "dead_spot":
        assert worst_place(seen) < 1.6  # [rad]: dead spots are planted at 0.5 to 1.0, 0.2 wide
    else:
        assert seen.held_out_r2 > 0.5


def worst_place(seen: RemainderStructure) -> float:
    """Where in the first signal the remainder is largest."""
    profile = seen.profiles[0]
    return float(profile.center[np.argmax(np.abs(profile.mean))])


def test_hands_leave_nothing_to_learn(tmp_path: Path) -> None:
    """Knocks come by chance: there is a gap, and nothing recorded predicts it."""
    study = planted(tmp_path, "hand_knocks", seed=4)
    assert not find_structure(study, {}).found


def test_the_servos_side_is_free_of_the_loop(tmp_path: Path) -> None:
    """An error of the mechanism moves both signals, but not the force at the measured motion."""
    study = planted(tmp_path, "joint_stiffness_error", seed=4)
    servo, mechanism = find_remainders(study, {})
    assert servo.size < 0.06  # [N] the cell's noise of 0.05 and the encoder's counts
    assert mechanism.size > 0.02  # [rad]


def made_up(residual: np.ndarray, signals: dict[str, np.ndarray]) -> Remainder:
    """A remainder of four recordings."""
    recording = np.arange(len(residual)) * 4 // len(residual)
    return Remainder(side="servo", residual=residual, signals=signals, recording=recording)


def test_slow_noise_is_not_taken_for_structure(rng: np.random.Generator) -> None:
    """Noise that wanders with the recording goes with time in each, and with nothing in all."""
    walk = np.cumsum(rng.normal(size=(4, 400)), axis=1)
    noise = (walk - walk.mean(axis=1, keepdims=True)).ravel()
    time = np.tile(np.arange(400) / 80.0, 4)
    signals = {"t": time, "theta": np.sin(time), "theta_d": rng.uniform(0.0, 6.0, 1600)}
    assert not look(made_up(noise, signals)).found


def test_numbers_that_only_their_sum_is_known_of_are_confounded(rng: np.random.Generator) -> None:
    """Two columns of a Jacobian that are nearly one give a correlation near -1."""
    column = rng.normal(size=300)
    twins = np.stack([column, column + 0.01 * rng.normal(size=300), rng.normal(size=300)], axis=1)
    point = Linearisation(residual=0.1 * rng.normal(size=300), jacobian=twins)
    (pair,) = find_confounded(point, ("a.x", "b.y", "c.z"))
    assert (pair.first, pair.second) == ("a.x", "b.y")
    assert pair.correlation < -0.99


def test_an_interval_as_wide_as_the_range_says_nothing() -> None:
    """It is flat from 95 % of the range on."""
    assert is_flat((0.0, 0.97), 0.0, 1.0)
    assert not is_flat((0.1, 0.9), 0.0, 1.0)
