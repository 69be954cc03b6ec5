"""Windows take the samples that a deployed network would have seen, and nothing else."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset, InvalidRecording
from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.samples.folds import split_train
from tendon_train.actuator.samples.sample_departure import (
    ANGLE,
    FIRST_SHARE,
    SHARE,
    SPEED,
    ZERO,
    departed,
    departing_share,
)
from tendon_train.actuator.samples.servo_law import FEWEST, NO_LAW, ServoLaw, fit_servo_law
from tendon_train.actuator.samples.windows import Windows, WindowShape, extract_windows, to_device
from tendon_train.actuator.training_config import Purpose, TrainingConfig
from tests.train.actuator.servo_logs import servo_log

FULL = WindowShape(pad_start=False)


def without_rows(recording: Recording, lost: slice) -> Recording:
    """Return a recording that lost some rows."""
    kept = np.ones(recording.sample_count, dtype=bool)
    kept[lost] = False
    return replace(
        recording,
        time=recording.time[kept],
        command=recording.command[kept],
        motor_position=recording.motor_position[kept],
        motor_velocity=recording.motor_velocity[kept],
        force=recording.force[kept],
        enabled=recording.enabled[kept],
    )


def test_a_window_is_every_fourth_row_and_all_four_phases_are_there() -> None:
    """80 Hz rows, 30 samples at 20 Hz: the first window ends at row 116 and each row ends one."""
    recording = servo_log("a.csv", duration=3.0)
    windows = extract_windows([recording], FULL)
    ends = np.arange(116, 240)
    np.testing.assert_array_equal(windows.last, ends)
    np.testing.assert_array_equal(windows.rows, ends[:, None] - 4 * np.arange(29, -1, -1))
    np.testing.assert_array_equal(windows.force, recording.force[:, 0])
    assert windows.inputs[7].tolist() == [
        recording.command[7, 0],
        recording.motor_position[7, 0],
        recording.motor_velocity[7, 0],
    ]


def test_the_start_is_filled_with_the_first_row_unless_it_moves() -> None:
    """Before a start at rest lie copies of the first row; a start in motion has no past."""
    recording = servo_log("a.csv", duration=3.0)
    padded = extract_windows([recording], WindowShape())
    assert padded.window_count == recording.sample_count
    assert padded.rows[5].tolist() == [0] * 28 + [1, 5]
    resting = replace(recording, start="first_row")
    assert extract_windows([resting], WindowShape()).window_count == 240
    moving = replace(resting, motor_velocity=recording.motor_velocity + 0.1)
    assert extract_windows([moving], WindowShape()).window_count == 240 - 116


def test_no_window_reaches_across_a_gap() -> None:
    """Rows 300 to 399 are missing: no window has rows on both sides."""
    windows = extract_windows([without_rows(servo_log("a.csv"), slice(300, 400))], FULL)
    before, after = windows.rows < 300, windows.rows >= 300
    assert (before.all(axis=1) | after.all(axis=1)).all()
    assert windows.window_count == (300 - 116) + (1600 - 400 - 116)


def test_a_single_lost_row_costs_only_the_windows_that_sample_it() -> None:
    """One row in 120 is in a quarter of the windows that span it, and ends one more."""
    whole = extract_windows([servo_log("a.csv")], FULL)
    lost = extract_windows([without_rows(servo_log("a.csv"), slice(700, 701))], FULL)
    assert whole.window_count - lost.window_count == 30


@pytest.mark.parametrize("rate", [50.0, 80.0, 100.0, 137.0, 500.0])
def test_any_rate_is_sampled_at_the_nearest_row(rate: float) -> None:
    """No sample is farther from its instant than half a row's step, plus rounding."""
    recording = servo_log("a.csv", duration=4.0, rate=rate)
    windows = extract_windows([recording], FULL)
    ends = recording.time[windows.last]
    instants = ends[:, None] - 0.05 * np.arange(29, -1, -1)
    assert np.abs(recording.time[windows.rows] - instants).max() <= 0.5 / rate + 1e-9


def test_uneven_rows_are_taken_where_they_were(rng: np.random.Generator) -> None:
    """Jitter of 1 ms leaves every window in place."""
    recording = servo_log("a.csv", duration=4.0)
    jittered = replace(recording, time=recording.time + rng.uniform(-5e-4, 5e-4, 320))
    even, uneven = extract_windows([recording], FULL), extract_windows([jittered], FULL)
    np.testing.assert_array_equal(even.rows, uneven.rows)


def test_a_window_with_the_motor_off_is_left_out() -> None:
    """Rows 400 to 409 without torque: no window holds one of them or spans them."""
    recording = servo_log("a.csv")
    enabled = np.ones(recording.sample_count, dtype=bool)
    enabled[400:410] = False
    windows = extract_windows([replace(recording, enabled=enabled)], FULL)
    spans = (windows.rows[:, 0] < 410) & (windows.last >= 400)
    assert not spans.any()
    assert windows.window_count == (400 - 116) + (1600 - 410 - 116)


def test_windows_keep_to_their_recording() -> None:
    """Windows of the second recording hold rows of the second one alone."""
    windows = extract_windows([servo_log("a.csv"), servo_log("b.csv", seed=1)], WindowShape())
    second = windows.source == 1
    assert windows.rows[second].min() == 1600
    assert windows.rows[~second].max() == 1599


def test_what_cannot_be_cut_is_named() -> None:
    """Too slow rows, a missing force and a recording shorter than a window are errors of ours."""
    with pytest.raises(InvalidRecording, match=r"b\.csv: windows sample 20 times a second"):
        extract_windows([servo_log("b.csv", rate=10.0)], FULL)
    with pytest.raises(InvalidRecording, match=r"b\.csv: .* force is missing"):
        extract_windows([replace(servo_log("b.csv"), force=None)], FULL)
    with pytest.raises(InvalidDataset, match="none of 1 recordings"):
        extract_windows([servo_log("b.csv", duration=1.0)], FULL)


def test_validation_recordings_are_whole_train_recordings_of_every_bench(tmp_path) -> None:
    """No recording is in both parts, and every bench with several recordings is in both."""
    from tendon_newton.data.dataset import load_dataset
    from tests.train.actuator.servo_logs import write_servo_dataset

    dataset = load_dataset(write_servo_dataset(tmp_path / "data", duration=4.0))
    fold = split_train(dataset)
    fit, held = {r.name for r in fold.fit}, {r.name for r in fold.validation}
    assert not fit & held
    assert fit | held == {r.name for r in dataset.train}
    assert {r.bench for r in fold.fit} == {r.bench for r in fold.validation}
    assert fold == split_train(dataset)


LAW = ServoLaw(stiffness=6.0, damping=10.0, dry_friction=1.2, load_friction=0.2)
RATE = 20.0  # Hz
COUNT = 4000


def sliding_rows(count: int, rng: np.random.Generator) -> Windows:
    """Return rows of a motor with friction, under loads of every kind; each is a window."""
    angle, speed = rng.uniform(0.0, 2.0, count), rng.normal(0.0, 0.5, count)
    force = rng.uniform(1.0, 15.0, count)
    friction = (LAW.dry_friction + LAW.load_friction * force) * np.sign(speed)
    command = angle + (force + LAW.damping * speed + friction) / LAW.stiffness
    rows = np.arange(count)[:, None]
    return Windows(
        inputs=np.stack([command, angle, speed], axis=1),
        force=force + rng.normal(0.0, 0.05, count),
        rows=rows,
        source=np.zeros(count, dtype=int),
    )


def test_the_law_of_a_servo_is_found_beside_its_friction(rng: np.random.Generator) -> None:
    """All to 1 %, from 3,000 rows with 0.05 N of noise, or to 0.02 N and 0.005."""
    law = fit_servo_law(sliding_rows(3000, rng))
    assert law.stiffness == pytest.approx(LAW.stiffness, rel=0.01)
    assert law.damping == pytest.approx(LAW.damping, rel=0.01)
    assert law.dry_friction == pytest.approx(LAW.dry_friction, abs=0.02)
    assert law.load_friction == pytest.approx(LAW.load_friction, abs=0.005)


def test_a_servo_that_hardly_slid_has_no_law(rng: np.random.Generator) -> None:
    """Its force is held as the paper does."""
    assert fit_servo_law(sliding_rows(FEWEST - 1, rng)) == NO_LAW


def test_a_network_for_predictions_ends_on_recordings() -> None:
    """Some of its windows depart at first, ever fewer, none in the last fifth.

    In a training for simulations half of them do to the end.
    """
    shares = [departing_share("prediction", done) for done in (0.0, 0.4, 0.8, 0.95)]
    assert shares == pytest.approx([FIRST_SHARE, 0.5 * FIRST_SHARE, 0.0, 0.0])
    assert departing_share("simulation", 0.95) == SHARE


def test_windows_depart_as_stated() -> None:
    """Half of them, by an angle that is the integral of a speed; the force is what the law says.

    4,000 windows: shares and standard deviations to 5 %.
    """
    still = torch.zeros(COUNT, 30, 3)
    moved, force = departed(still, LAW, RATE, SHARE, torch.Generator().manual_seed(0))
    command, angle, speed = moved.unbind(dim=2)
    gone = command[:, 0] != 0.0
    assert float(gone.float().mean()) == pytest.approx(SHARE, rel=0.05)
    assert not moved[~gone].any()
    assert not force[~gone].any()
    assert float(command[gone, 0].std()) == pytest.approx(ZERO, rel=0.05)
    assert float(command.std(dim=1).max()) < 1e-6
    turned = angle - command
    assert float(turned[gone, 0].std()) == pytest.approx(ANGLE, rel=0.05)
    steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) / RATE
    torch.testing.assert_close(turned.diff(dim=1), steps, atol=1e-5, rtol=0.0)
    # evenly drawn sizes: a third of the largest variance
    assert float(speed[gone].std()) == pytest.approx(SPEED / 3.0**0.5, rel=0.05)
    assert float(speed[gone, 0].std()) == pytest.approx(float(speed[gone, -1].std()), rel=0.1)
    expected = -LAW.stiffness * turned - LAW.damping * speed
    torch.testing.assert_close(force, expected)


@pytest.mark.parametrize(
    ("purpose", "follows"),
    [("simulation", True), pytest.param("prediction", False, marks=pytest.mark.slow)],
)
def test_a_network_for_simulations_knows_the_force_beside_the_recordings(
    tmp_path: Path, purpose: Purpose, follows: bool
) -> None:
    """Where the shaft stands off its recording by 0.2 rad, the force is off as the law says.

    That is 1.2 N, to a third after a short training. Recordings of one load alone do not teach it.
    """
    logs = [
        servo_log(f"{seed}.csv", excitation=kind, seed=seed)
        for seed, kind in enumerate(("random_steps", "sine", "ramps", "random_steps"))
    ]
    fit, held_out = (extract_windows(part, WindowShape()) for part in (logs[:3], logs[3:]))
    config = TrainingConfig(
        network="mlp", purpose=purpose, epochs=6, windows_per_epoch=4096, learning_rate=6.0e-3
    )
    network, _ = train_network(config, fit, held_out, tmp_path / "a.checkpoint", law=LAW)
    windows = to_device(held_out, "cpu").batch(torch.arange(0, held_out.window_count, 4))
    beside = windows.clone()
    beside[:, :, 1] += 0.2
    with torch.no_grad():
        fall = float((network(windows) - network(beside)).mean())
    assert (fall == pytest.approx(0.2 * LAW.stiffness, rel=1.0 / 3.0)) == follows
