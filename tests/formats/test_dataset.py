"""What a dataset folder keeps."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.errors import InvalidDataset
from tests.importers.logs import dataset, recording


def test_what_an_entry_says_comes_back(tmp_path: Path) -> None:
    """Start, overrides and load cell rate of a recording survive writing and reading."""
    log = recording(
        "sub/run.csv",
        start="first_row",
        bench_overrides=BenchOverrides(mass=(0.49,), range=(1.75, 1.4)),
        actuator_overrides={"duty_per_rad": 1.1},
        load_cell_rate=20.0,
    )
    write_dataset(tmp_path, [log], [recording("test.csv")])
    (back,) = load_dataset(tmp_path).train
    assert back.name == "sub/run.csv"
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
