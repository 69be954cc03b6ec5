"""An evaluation compares fairly: the same rows, the better ideal source, held-out recordings."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_lab.force_scoring.ideal_baseline import ideal_force, refitted_gain
from tendon_lab.force_scoring.sample_protocol import Experiment, experiment_of
from tendon_lab.force_scoring.scores import lag, score
from tendon_train.actuator.prediction import ForcePrediction
from tests.train.actuator.servo_logs import GAIN, servo_log


def prediction_of(measured: np.ndarray, predicted: np.ndarray) -> ForcePrediction:
    """Pair two signals at 80 Hz."""
    recording = servo_log("a.csv", duration=measured.size / 80.0)
    rows = np.arange(measured.size)
    return ForcePrediction(
        recording=recording, tendon=0, rows=rows, measured=measured, predicted=predicted
    )


def test_scores_pool_rows_and_not_recordings() -> None:
    """Errors of 1 N on 300 rows and 3 N on 100 rows: the root of 3, the mean of 1.5."""
    found = score(
        [
            prediction_of(np.full(300, 5.0), np.full(300, 4.0)),
            prediction_of(np.full(100, 5.0), np.full(100, 2.0)),
        ]
    )
    assert found.rmse == pytest.approx(np.sqrt(3.0))
    assert found.bias == pytest.approx(1.5)
    assert found.error_spread == pytest.approx(np.sqrt(3.0 - 1.5**2))
    assert found.rows == 400


@pytest.mark.parametrize("gain", [1.0, GAIN, 20.0])
def test_the_refitted_gain_is_the_best_one(gain: float, rng: np.random.Generator) -> None:
    """Of a plant that is an ideal source but for noise, clipped at both ends, it finds the gain.

    The noise is 0.1 N over some 800 unclipped rows of several newtons: 1 % is 10 standard errors.
    """
    log = servo_log("a.csv", excitation="sine")
    true = ideal_force(log, 0, gain, 21.0)
    measured = replace(log, force=(true + rng.normal(0.0, 0.1, true.size))[:, None])
    assert refitted_gain([measured], 21.0) == pytest.approx(gain, rel=0.01)


@pytest.mark.parametrize("hold", [1.0, 2.0, 3.0])
def test_test_steps_are_known_by_their_command(hold: float) -> None:
    """Whatever the file is called: 0, 2, 4, 1 rad held for as long."""
    log = servo_log("x.csv", excitation=f"steps_held_{hold:g}s", duration=5.0 * hold)
    assert experiment_of(log) == Experiment(bench="finger", kind="steps", hold=hold)


def test_other_experiments_are_known_by_their_name() -> None:
    """Bench and number stripped; numbered runs of one kind are one experiment."""
    names = {
        "finger_contact_ramp_tape_roll_0.csv": "contact_ramp_tape_roll",
        "finger_closing_sine_hand_perturbation_12.mcap": "closing_sine_hand_perturbation",
        "monday.csv": "monday",
    }
    for name, kind in names.items():
        log = servo_log(name, excitation="contact_ramp", duration=3.0)
        assert experiment_of(log) == Experiment(bench="finger", kind=kind)
    assert Experiment(bench="finger", kind="contact_ramp_hand").is_contact_ramp
    assert Experiment(bench="finger", kind="closing_sine_hand_perturbation").is_perturbed_sine


TIME = np.arange(24 * 80) / 80.0


def held_steps(at: np.ndarray) -> np.ndarray:
    """Return a spring's force under the paper's steps [N]: up in a second, down within a tenth.

    Held for 3 s; the last one is let go of slowly, as a motor does that is driven back by its load.
    """
    phase, force = np.mod(at, 12.0), np.zeros_like(at)
    for start, height, time in ((0.0, 5.0, 0.5), (3.0, 6.0, 0.5), (6.0, -4.0, 0.05)):
        force += height * (1.0 - np.exp(-np.maximum(phase - start, 0.0) / time))
    return force - 7.0 * (1.0 - np.exp(-np.maximum(phase - 9.0, 0.0) / 1.0))


@pytest.mark.parametrize("of_changes", [False, True])
@pytest.mark.parametrize("late", [-0.1, 0.0, 0.03, 0.055, 0.2])
def test_a_lag_is_found_to_a_tenth_of_a_row(late, of_changes, rng) -> None:
    """A smooth signal against itself, shifted by a known time: 1.25 ms is a tenth of a row."""
    pace, phase = rng.uniform(1.0, 8.0, 12), rng.uniform(0.0, 6.0, 12)

    def signal(at: np.ndarray) -> np.ndarray:
        return 5.0 + np.sin(np.outer(at, pace) + phase).sum(axis=1)

    found = lag([prediction_of(signal(TIME), signal(TIME - late))], of_changes=of_changes)
    assert found.shift == pytest.approx(late, abs=1.25e-3)
    assert found.error < 1.25e-3


@pytest.mark.parametrize("late", [-0.05, 0.0, 0.025])
def test_a_release_that_is_guessed_too_steep_moves_forces_and_not_their_changes(late, rng) -> None:
    """A network that falls 3 N at once, where a motor gives way in 2 s, is not ahead of time.

    Its noise is 0.2 N. Within a row, 12.5 ms, the edges tell the shift that is there; the whole
    force tells another, by more than the 25 ms that matter.
    """
    phase = np.mod(TIME - late, 12.0)
    guessed = held_steps(TIME - late) - 3.0 * np.exp(-(phase - 9.0) / 0.7) * (phase >= 9.0)
    pair = prediction_of(held_steps(TIME), guessed + rng.normal(0.0, 0.2, TIME.size))
    by_changes, by_force = lag([pair], of_changes=True), lag([pair], of_changes=False)
    assert by_changes.shift == pytest.approx(late, abs=12.5e-3)
    assert by_force.shift < late - 0.025


def test_the_error_of_a_lag_covers_what_it_is_off(rng: np.random.Generator) -> None:
    """Of 40 predictions that are late by 20 ms and wrong in many sizes, most are within two errors.

    Three quarters, not 95 %: a bootstrap of some twenty seconds is a little too sure.
    """
    within = 0
    for _ in range(40):
        size = np.interp(TIME, np.arange(0.0, 25.0), 1.0 + rng.normal(0.0, 0.3, 25))
        found = lag(
            [prediction_of(held_steps(TIME), size * held_steps(TIME - 0.02))], of_changes=True
        )
        within += abs(found.shift - 0.02) < 2.0 * found.error
    assert within >= 30


def test_recordings_are_pooled(rng: np.random.Generator) -> None:
    """Two recordings know more than one: the lag is between theirs, and its error no larger."""
    pairs = [
        prediction_of(held_steps(TIME), held_steps(TIME - late) + rng.normal(0.0, 0.2, TIME.size))
        for late in (0.02, 0.04)
    ]
    found = lag(pairs, of_changes=True)
    assert 0.02 < found.shift < 0.04


def test_a_constant_and_a_moment_have_no_lag() -> None:
    """Where nothing moves, or where it does for two seconds only, nothing can be late."""
    still = prediction_of(np.full(800, 3.0), np.full(800, 3.0))
    short = prediction_of(held_steps(TIME)[:160], held_steps(TIME)[:160])
    for pair in (still, short):
        assert lag([pair], of_changes=False) is None
        assert lag([pair], of_changes=True) is None
