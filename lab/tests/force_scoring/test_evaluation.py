"""An evaluation compares fairly: the same rows, the better ideal source, held-out recordings."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_lab.force_scoring.ideal_baseline import ideal_force, refitted_gain
from tendon_lab.force_scoring.sample_protocol import Experiment, experiment_of
from tendon_lab.force_scoring.scores import score
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
