"""Without a load cell: the force that motion implies, and the network that learns it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_lab.without_cell.sensorless import ImpliedForces, imply_forces
from tendon_lab.without_cell.sensorless_fit import LineFit
from tendon_lab.without_cell.sensorless_line import Line, nominal_line
from tendon_lab.without_cell.sensorless_motion import TURN, motions_of
from tendon_lab.without_cell.sensorless_rows import sliding_windows
from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.cli import main
from tendon_newton.data.dataset import Dataset, write_dataset
from tendon_newton.data.recording import BenchOverrides, Recording
from tendon_newton.diagnosis.in_time.balance import turned
from tendon_newton.errors import InvalidDataset
from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.prediction import predict
from tendon_train.actuator.samples.folds import prepare
from tendon_train.actuator.samples.servo_law import SLIDING
from tendon_train.actuator.training_config import TrainingConfig
from tests.bad_input.damage import refusal
from tests.train.actuator.network_files import card_of
from tests.train.tendon.pulled_benches import TRUE as LINES
from tests.train.tendon.pulled_benches import pulled_log, pulled_logs, with_force

FIT = LineFit(steps=300)
FEW = LineFit(steps=20)
EXCITATIONS = ("random_steps", "sine", "ramps", "stairs")

TRUE = {bench: Line(bench=bench, **vars(line)) for bench, line in LINES.items()}


def dataset_of(train: tuple[Recording, ...], test: tuple[Recording, ...] = ()) -> Dataset:
    """Put recordings into a dataset that lies nowhere."""
    return Dataset(path=Path("nowhere"), train=train, test=test)


@pytest.fixture(scope="module")
def implied() -> ImpliedForces:
    """Forces that the motion of three benches implies."""
    return imply_forces(dataset_of(pulled_logs(*EXCITATIONS)), FIT)


def rmse(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def test_one_servo_on_several_benches_tells_what_their_lines_give(implied: ImpliedForces) -> None:
    """The implied forces are closer to the true ones than those of the nominal lines, everywhere.

    The soft spring is known to 3 %; the give of the other lines, 8 % of a stiff spring and 30 % of
    a finger's line, is found from the servo. Within a twentieth of the force's RMS: what the
    springs' tolerance leaves open (3 %), with room for a short fit.
    """
    motions = {m.recording.name: m for m in motions_of(pulled_logs(*EXCITATIONS))}
    for line in implied.lines:
        found, promised, true = [], [], []
        for recording in (r for r in implied.dataset.train if r.bench == line.bench):
            motion = motions[recording.name]
            true.append(TRUE[line.bench].tension(motion))
            found.append(line.tension(motion))
            promised.append(nominal_line(line.bench, motion.mechanism).tension(motion))
        felt = np.concatenate(true)
        error = rmse(np.concatenate(found) - felt)
        assert error < 0.05 * rmse(felt)
        if line.bench != "spring_weak":
            assert error < 0.7 * rmse(np.concatenate(promised) - felt)


def test_a_camera_that_is_off_by_half_a_millimetre_costs_little() -> None:
    """Along x and z, on all recordings: within a tenth of the force's RMS, where it was 4 %.

    Half a millimetre of a finger's line is some 4 N.
    """
    logs, off = pulled_logs(*EXCITATIONS), np.array([4.0e-4, -3.0e-4])
    shifted = [r if r.tip is None else replace(r, tip=r.tip + off) for r in logs]
    found = imply_forces(dataset_of(tuple(shifted)), FIT)
    true, implied = (
        np.concatenate([r.force[:, 0] for r in train if r.bench == "finger"])
        for train in (logs, found.dataset.train)
    )
    assert rmse(implied - true) < 0.1 * rmse(true)


def test_no_measured_force_has_a_part_in_it() -> None:
    """Absent, true or nonsense: the same lines and the same implied forces, bit for bit."""
    logs = pulled_logs("sine", duration=6.0)
    nonsense = tuple(with_force(r, np.full((r.sample_count, 1), 17.0)) for r in logs)
    absent = tuple(with_force(r, None) for r in logs)
    assert all(motion.recording.force is None for motion in motions_of(nonsense))
    first, *others = (imply_forces(dataset_of(train), FEW) for train in (logs, nonsense, absent))
    for other in others:
        assert other.lines == first.lines
        for one, same in zip(first.dataset.train, other.dataset.train, strict=True):
            np.testing.assert_array_equal(one.force, same.force)


def test_a_true_line_implies_the_true_force() -> None:
    """On every bench; on the finger by the angles that its tip tells, to their rounding."""
    for bench, line in TRUE.items():
        (motion,) = motions_of([log := pulled_log(bench)])
        np.testing.assert_allclose(line.tension(motion), log.force[:, 0], atol=1e-5)


def test_what_blocks_a_finger_does_not_enter() -> None:
    """Held at a posture while the spool winds on, the line's stretch alone is the force."""
    log = pulled_log("finger")
    held = replace(log, tip=np.broadcast_to(log.tip[0], log.tip.shape))
    (motion,) = motions_of([held])
    line = replace(TRUE["finger"], friction=0.0)
    stretch = motion.wound - motion.wound[0]
    assert np.ptp(stretch) > 1e-3
    expected = line.tension(motion)[0] + line.stiffness * stretch
    np.testing.assert_allclose(line.tension(motion), np.maximum(0.0, expected), rtol=1e-9)


def test_a_turn_within_the_play_of_the_guide_is_no_change_of_direction() -> None:
    """It changes sides over a hundredth of a radian, and stays through an encoder's noise."""
    there_and_back = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    direction = turned(there_and_back, 0.5 * TURN)
    assert direction[10] == direction[199] == 1.0
    assert direction[205] == direction[-1] == -1.0
    still = np.concatenate([[0.0, 1.0], 1.0 + 0.0015 * (-1.0) ** np.arange(50)])
    assert np.all(turned(still, 0.5 * TURN)[1:] > 0.3)


def test_benches_are_compared_where_the_servo_turns_one_way() -> None:
    """From the first to the last row of each window, 0.1 s, faster than a gear that may stick."""
    (motion,) = motions_of([log := pulled_log("spring_weak")])
    windows = sliding_windows(motion)
    speed = log.motor_velocity[:, 0]
    assert 10 < len(windows) < log.sample_count / 6
    for first, _, last in windows:
        assert last - first == 8  # rows at 80 Hz
        way = np.sign(speed[last])
        assert np.all(way * speed[first : last + 1] > SLIDING)


def test_servos_that_rest_tell_nothing() -> None:
    """No row to compare benches by: one line that says what is missing."""
    logs = [
        replace(
            log,
            motor_position=np.full_like(log.motor_position, 1.0),
            motor_velocity=np.zeros_like(log.motor_velocity),
        )
        for log in pulled_logs("sine", duration=6.0)
    ]
    with pytest.raises(InvalidDataset, match="none of 3 recordings has one"):
        imply_forces(dataset_of(tuple(logs)), FEW)


def test_only_recordings_that_tell_something_are_used() -> None:
    """A finger without a seen tip, a pendulum and a recording without a command are left out."""
    finger, slider = pulled_log("finger", duration=6.0), pulled_log("spring_weak", duration=6.0)
    pendulum = replace(slider, name="p.csv", bench="pendulum")
    others = (replace(finger, tip=None), pendulum, replace(slider, command=None))
    assert [m.recording.name for m in motions_of([*others, slider])] == [slider.name]
    with pytest.raises(InvalidDataset, match="none of 3 train recordings has them"):
        motions_of(others)


def test_recordings_of_one_bench_with_different_springs_are_refused() -> None:
    """One line per bench is found, so that its numbers must be the bench's."""
    logs = pulled_logs("sine", duration=6.0)
    other = replace(logs[0], bench_overrides=BenchOverrides(stiffness=(300.0,)))
    with pytest.raises(InvalidDataset, match="same spring and moment arms"):
        imply_forces(dataset_of((*logs, other)), FEW)


def test_a_network_without_a_load_cell_is_nearly_as_good_as_one_with_it(implied, tmp_path) -> None:
    """Trained alike on the same motions, on runs that neither saw: within a quarter."""
    test = pulled_logs("steps_held_2s", first_seed=9)
    config = TrainingConfig(
        network="mlp", epochs=8, windows_per_epoch=4096, batch=128, learning_rate=6.0e-3
    )
    error = {}
    for name, train in (("with", pulled_logs(*EXCITATIONS)), ("without", implied.dataset.train)):
        data = prepare(dataset_of(train, test), config)
        network, _ = train_network(config, data.fit, data.validation, tmp_path / name)
        predictions = predict(network, card_of("mlp", window=30, streaming=False), test)
        error[name] = rmse(np.concatenate([p.error for p in predictions]))
    assert error["without"] < 1.25 * error["with"]


def test_a_user_trains_a_network_without_a_load_cell(tmp_path, capsys) -> None:
    """From a dataset without a force column to a network whose card says what its force is."""
    logs = pulled_logs("random_steps", "sine", duration=10.0)
    write_dataset(tmp_path / "data", [with_force(r, None) for r in logs], [])
    words = ["--network", "mlp", "--epochs", "1", "--windows-per-epoch", "1024"]
    out = tmp_path / "nets"
    call = ["train-force-without-cell", str(tmp_path / "data"), "--out", str(out)]
    assert main([*call, *words]) == 0
    assert "spring_strong: " in capsys.readouterr().out
    lines = json.loads((out / "mlp-paper-0.lines.json").read_text())
    assert {line["bench"] for line in lines} == {*TRUE}
    network = load_network(out / "mlp-paper-0.pt")
    assert "implied by their motion" in network.card.training.split
    assert network.card.held_out is None


def test_a_dataset_that_tells_nothing_is_one_line(tmp_path, capsys) -> None:
    """Fingers without a tip: exit code 2 and what is needed."""
    logs = [replace(pulled_log("finger", seed=seed), tip=None) for seed in (0, 1)]
    write_dataset(tmp_path / "data", [replace(r, name=f"{i}.csv") for i, r in enumerate(logs)], [])
    call = ["train-force-without-cell", str(tmp_path / "data"), "--out", str(tmp_path)]
    assert "without a load cell" in refusal(call, capsys)
