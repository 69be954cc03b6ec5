"""What a recording promises, and what its file keeps."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.channels import CHANNELS
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.importers.own import read_own
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset, InvalidRecording
from tests.importers.logs import ROWS, dataset, recording


def channel(lower: float, upper: float, width: int) -> st.SearchStrategy[np.ndarray]:
    """Any values inside a channel's range, one column per tendon."""
    return arrays(np.float64, (ROWS, width), elements=st.floats(lower, upper))


def test_arrays_of_a_recording_cannot_be_written() -> None:
    """Neither the arrays nor the mappings of a recording can change after it was checked."""
    log = recording(extra={"duty": np.zeros(ROWS)})
    with pytest.raises(ValueError, match="read-only"):
        log.motor_position[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        log.extra["duty"][0] = 1.0
    with pytest.raises(TypeError):
        log.extra["more"] = np.zeros(ROWS)  # pyright: ignore[reportIndexIssue]


def test_a_recording_does_not_alias_what_it_was_built_from() -> None:
    """Writing to the source array afterwards does not reach the recording."""
    theta = np.zeros((ROWS, 1))
    log = recording(motor_position=theta)
    theta[0] = 7.0
    assert log.motor_position[0, 0] == 0.0


def test_motor_is_enabled_unless_the_file_says_otherwise() -> None:
    """Without an ``enabled`` column every row is powered."""
    assert recording().enabled.shape == (ROWS,)
    assert recording().enabled.all()


def test_uneven_sampling_and_gaps_are_legal() -> None:
    """Only order matters: a gap of seconds and jitter are data, not errors."""
    time = np.cumsum(np.linspace(0.004, 0.02, ROWS))
    time[10:] += 3.0
    assert recording(time=time).duration == pytest.approx(time[-1] - time[0])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"force": np.full((ROWS, 1), 5200.0)}, r"newtons; row 0 .* 5200.*millinewtons or grams"),
        ({"motor_position": np.full((ROWS, 1), 90.0)}, r"theta must be in radians.*degrees"),
        ({"command": np.full((ROWS, 1), -180.0)}, r"theta_d must be in radians.*degrees"),
        ({"time": np.arange(ROWS) * 12.5}, r"t must be in seconds; its median step is 12.5.*milli"),
        ({"time": np.arange(ROWS) * 12500.0}, r"t must be in seconds.*microseconds"),
        ({"voltage": np.full(ROWS, 7400.0)}, r"voltage must be in volts.*millivolts"),
        ({"current": np.full(ROWS, 350.0)}, r"current must be in amperes.*milliamperes"),
        ({"temperature": np.full(ROWS, 302.0)}, r"temperature must be in degrees.*kelvins"),
        ({"tip": np.full((ROWS, 2), 55.0)}, r"tip_x must be in metres.*millimetres"),
    ],
)
def test_a_wrong_unit_is_named(changes: dict, said: str) -> None:
    """Values that no bench reaches are refused with the unit that they look like."""
    with pytest.raises(InvalidRecording, match=said):
        recording(**changes)


def test_the_first_bad_value_is_named_by_row_and_column() -> None:
    """NaN in the second tendon at row 12 is reported as that."""
    theta = np.zeros((ROWS, 2))
    theta[12, 1] = np.nan
    with pytest.raises(InvalidRecording, match=r"theta_1 must be finite; row 12 \(t = 0.15 s\)"):
        recording(motor_position=theta, motor_velocity=theta, command=None, force=theta)


def test_something_must_drive_the_simulation() -> None:
    """Without theta_d and without force nothing drives either side."""
    with pytest.raises(InvalidRecording, match="theta_d or force must be there"):
        recording(command=None, force=None)


def test_tendons_must_match() -> None:
    """Two commands for one measured shaft are refused."""
    with pytest.raises(InvalidRecording, match=r"theta_d must have the shape \(20, 1\)"):
        recording(command=np.zeros((ROWS, 2)))


@given(
    width=st.integers(1, 3),
    data=st.data(),
    start=st.floats(-1e3, 1e3),
    steps=arrays(np.float64, ROWS, elements=st.floats(1e-3, 0.4)),
)
def test_a_csv_file_keeps_every_bit(tmp_path_factory, width, data, start, steps) -> None:
    """Written and read again, every number is the same float64, unknown columns included."""
    log = recording(
        time=start + np.cumsum(steps),
        command=data.draw(channel(-60.0, 60.0, width)),
        motor_position=data.draw(channel(-60.0, 60.0, width)),
        motor_velocity=data.draw(channel(-900.0, 900.0, width)),
        force=data.draw(channel(-1e3, 1e3, width)),
        tip=data.draw(channel(-1.0, 1.0, 2)),
        joint_position=data.draw(channel(-6.0, 6.0, data.draw(st.integers(1, 3)))),
        voltage=data.draw(channel(0.0, 40.0, 1))[:, 0],
        enabled=data.draw(arrays(np.bool_, ROWS)),
        extra={"duty": data.draw(channel(-1e300, 1e300, 1))[:, 0]},
    )
    path = tmp_path_factory.mktemp("csv") / log.name
    write_csv(path, log)
    assert_equal(read_recording_file(path, bench="finger"), log)


def assert_equal(one: Recording, other: Recording) -> None:
    """Compare all channels of two recordings, bit for bit."""
    for name in ("time", *(channel.field for channel in CHANNELS)):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.enabled, other.enabled)
    assert list(one.extra) == list(other.extra)
    for name, values in one.extra.items():
        np.testing.assert_array_equal(values, other.extra[name])


def test_unknown_columns_are_kept_as_numbers_or_words(tmp_path: Path) -> None:
    """A column that the format does not know comes back, whatever it holds."""
    path = tmp_path / "run.csv"
    path.write_text("phase,theta_dot,t,theta,force,humidity\nup,0,0,0,1,0.4\ndown,0,0.01,0,1,\n")
    log = read_recording_file(path, bench="finger")
    assert list(log.extra["phase"]) == ["up", "down"]
    assert list(log.extra["humidity"]) == ["0.4", ""]
    assert log.command is None
    write_csv(path, log)
    assert list(read_recording_file(path, bench="finger").extra["phase"]) == ["up", "down"]


def test_a_byte_order_mark_and_spaces_after_commas_are_read(tmp_path: Path) -> None:
    """Spreadsheets write both."""
    path = tmp_path / "run.csv"
    path.write_text("\ufefft, theta, theta_dot, theta_d\r\n0, 0, 0, 1\r\n0.01, 0, 0, 1\r\n")
    assert read_recording_file(path, bench="finger").sample_count == 2


def test_tendons_that_are_switched_apart_are_refused(tmp_path: Path) -> None:
    """One motor off and the other on cannot be told by one flag, so it must not pass unseen."""
    path = tmp_path / "run.csv"
    header = "t,theta_0,theta_1,theta_dot_0,theta_dot_1,force_0,force_1,enabled_0,enabled_1\n"
    path.write_text(header + "0,0,0,0,0,1,1,1,0\n0.01,0,0,0,0,1,1,1,1\n")
    with pytest.raises(InvalidRecording, match="enabled must be the same for all tendons"):
        read_recording_file(path, bench="finger")
    path.write_text(header + "0,0,0,0,0,1,1,0,0\n0.01,0,0,0,0,1,1,1,1\n")
    assert list(read_recording_file(path, bench="finger").enabled) == [False, True]


@pytest.mark.parametrize("mend", [False, True])
def test_what_an_entry_says_comes_back(mend: bool, tmp_path: Path) -> None:
    """Start, obstacle, overrides and load cell rate survive writing and reading, mended or not."""
    log = recording(
        "sub/run.csv",
        start="first_row",
        bench_overrides=BenchOverrides(mass=(0.49,), range=(1.75, 1.4)),
        actuator_overrides={"duty_per_rad": 1.1},
        load_cell_rate=20.0,
        obstacle="ball",
    )
    write_dataset(tmp_path, [log], [recording("test.csv")])
    (back,) = (read_own(tmp_path, mend=True) if mend else load_dataset(tmp_path)).train
    assert back.name == "sub/run.csv"
    assert back.obstacle == "ball"
    assert back.start == "first_row"
    assert back.bench_overrides == log.bench_overrides
    assert dict(back.actuator_overrides) == {"duty_per_rad": 1.1}
    assert back.load_cell_rate == 20.0


def test_splits_stay_apart_and_in_order(tmp_path: Path) -> None:
    """Train and test recordings come back in the order of the file."""
    train = [recording(f"a{k}.csv") for k in range(3)]
    write_dataset(tmp_path, train, [recording("b.csv")])
    loaded = load_dataset(tmp_path)
    assert [log.name for log in loaded.train] == ["a0.csv", "a1.csv", "a2.csv"]
    assert [log.name for log in loaded.test] == ["b.csv"]


def test_a_missing_force_column_stays_missing(tmp_path: Path) -> None:
    """Without a load cell ``force`` is absent, not zero."""
    assert load_dataset(dataset(tmp_path)).test[0].force is None


def test_a_simulation_needs_no_split(tmp_path: Path) -> None:
    """A dataset of train recordings alone is refused for a diagnosis and read for a simulation."""
    write_dataset(tmp_path, [recording()], [])
    with pytest.raises(InvalidDataset, match='give at least one whole recording split = "test"'):
        load_dataset(tmp_path)
    assert len(load_dataset(tmp_path, require_test=False).train) == 1


def test_whole_numbers_and_lone_numbers_are_read_as_bench_numbers(tmp_path: Path) -> None:
    """``mass = 1`` is one joint's mass of 1.0 kg."""
    dataset(tmp_path)
    with (tmp_path / "dataset.toml").open("a") as file:
        file.write("\n[recordings.bench_overrides]\nmass = 1\nlength = [0.03, 0.025]\n")
    overrides = load_dataset(tmp_path).test[0].bench_overrides
    assert overrides.given == {"mass": (1.0,), "length": (0.03, 0.025)}


def test_every_reference_dataset_loads(shared: Path) -> None:
    """All datasets of the reference folder are read, with a train and a test split each."""
    folders = sorted(path.parent for path in (shared / "challenges").glob("*/dataset.toml"))
    for folder in folders:
        loaded = load_dataset(folder)
        for log in (*loaded.train, *loaded.test):
            assert np.all(np.diff(log.time) > 0.0)
    assert folders
