"""Whatever a file holds, its reader returns a valid object or one of our errors.

Every example starts from a sound file and spoils it up to three times. A library's exception, a
warning, a hang and a message that repeats the junk are all failures.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tendon_newton.dataset import Dataset, load_dataset
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.explanation import OpenClass
from tendon_newton.diagnosis.open_class_file import read_open_class
from tendon_newton.diagnosis.truth_file import read_truth
from tendon_newton.errors import TendonNewtonError
from tendon_newton.model_file import load_model, write_model
from tendon_newton.recording import Recording
from tendon_newton.recording_formats.csv_file import read_csv, write_csv
from tests.formats.logs import ROWS, dataset, recording
from tests.formats.mutations import (
    REPLACEMENTS,
    Change,
    byte_changes,
    cell_changes,
    replace_file,
    table_changes,
)
from tests.formats.test_bad_input_exams import ANSWER, OPEN, TRUTH

MESSAGE_LIMIT = 4000
"""Longest message [characters]: some name a path of 1000, and forty names of 80."""
EXAMPLES = 300
MODEL: dict[str, Any] = {
    "bench_overrides": {"finger": {"mass": [0.012, 0.008]}},
    "fit": ["gain"],
    "actuator": {"kind": "ideal", "gain": 4.2, "spool_radius": 0.0125},
    "effects": [
        {"name": "viscous_friction", "coefficient": 1.5},
        {"name": "stribeck_friction", "coulomb_force": 1.0, "static_force": 2.0},
    ],
}
DATASET: dict[str, Any] = {
    "recordings": [
        {
            "file": "train.csv",
            "bench": "finger",
            "split": "train",
            "start": "first_row",
            "bench_overrides": {"mass": [0.012, 0.008], "range": [1.7, 1.4]},
            "actuator_overrides": {"gain": 4.0},
            "load_cell_rate": 20,
        },
        {"file": "test.csv", "bench": "finger", "split": "test"},
    ]
}

fuzz = settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])


def accepted(read: Callable[[Path], Any], path: Path) -> Any:
    """Return what a reader makes of a file, or None where it refuses as it should."""
    try:
        return read(path)
    except TendonNewtonError as error:
        message = str(error)
        assert path.stem in message or "train.csv" in message  # the recording that it lists
        assert len(message) < MESSAGE_LIMIT
        return None


def spoiled(content: bytes, changes: list[Change]) -> bytes:
    """Apply changes one after the other."""
    for change in changes:
        content = change(content)
    return content


def rewritten(table: Any, changes: list[Callable[[Any], Any]], dump: Callable[[Any], str]) -> bytes:
    """Apply changes to a table and write it; what cannot be written stays as it was."""
    content = dump(table)
    for change in changes:
        table = change(table)
        try:
            content = dump(table)
        except (TypeError, ValueError, AttributeError):  # a TOML file is a table, keys are text
            break
    return content.encode()


def csv_columns(folder: Path) -> bytes:
    """A recording of two tendons with every kind of column."""
    theta = recording().motor_position.repeat(2, axis=1)
    made = recording(
        motor_position=theta, motor_velocity=theta, command=theta, force=theta,
        tip=np.zeros((ROWS, 2)), voltage=np.full(ROWS, 7.4),
        enabled=np.arange(ROWS) < ROWS - 2, extra={"note": np.full(ROWS, "a, b")},
    )  # fmt: skip
    write_csv(folder / "sound.csv", made)
    return (folder / "sound.csv").read_bytes()


def read_finger(path: Path) -> Recording:
    """Read a CSV file as a log of the finger."""
    return read_csv(path, bench="finger")


def read_whole(path: Path) -> Dataset:
    """Read a dataset that may lack a split."""
    return load_dataset(path.parent, require_train=False, require_test=False)


def read_open(path: Path) -> OpenClass:
    """Read the class that a diagnosis left open."""
    return read_open_class(path.parent)


@fuzz
@given(changes=st.lists(st.one_of(cell_changes(), byte_changes()), min_size=1, max_size=3))
def test_a_spoiled_recording_is_read_or_refused(tmp_path: Path, changes: list[Change]) -> None:
    """What is read can be written and read again, every number the same."""
    path = tmp_path / "spoiled.csv"
    path.write_bytes(spoiled(csv_columns(tmp_path), changes))
    made = accepted(read_finger, path)
    if made is None:
        return
    write_csv(tmp_path / "again.csv", made)
    again = read_finger(tmp_path / "again.csv")
    for name in ("time", "motor_position", "motor_velocity", "command", "force", "enabled"):
        assert np.array_equal(getattr(made, name), getattr(again, name))
    assert set(made.extra) == set(again.extra)


@fuzz
@given(
    table=st.lists(table_changes(), max_size=3),
    content=st.lists(byte_changes(), max_size=1),
)
def test_a_spoiled_model_is_read_or_refused(
    tmp_path: Path, table: list[Callable[[Any], Any]], content: list[Change]
) -> None:
    """What is read can be written and read again, equal."""
    path = tmp_path / "spoiled.toml"
    path.write_bytes(spoiled(rewritten(MODEL, table, tomli_w.dumps), content))
    model = accepted(load_model, path)
    if model is not None:
        write_model(tmp_path / "again.toml", model)
        assert load_model(tmp_path / "again.toml") == model


@fuzz
@given(
    table=st.lists(table_changes(), max_size=3),
    content=st.lists(byte_changes(), max_size=1),
)
def test_a_spoiled_dataset_file_is_read_or_refused(
    tmp_path: Path, table: list[Callable[[Any], Any]], content: list[Change]
) -> None:
    """Whatever dataset.toml says, the recordings come or the refusal names it or one of them."""
    folder = dataset(tmp_path / "dataset")
    path = folder / "dataset.toml"
    path.write_bytes(spoiled(rewritten(DATASET, table, tomli_w.dumps), content))
    read = accepted(read_whole, path)
    if read is not None:
        assert len(read.train) + len(read.test) > 0


@pytest.mark.parametrize(
    ("sound", "read"),
    [(ANSWER, read_diagnosis), (TRUTH, read_truth), (OPEN, read_open)],
    ids=["diagnosis", "truth", "class"],
)
@fuzz
@given(
    table=st.lists(table_changes(), max_size=3),
    content=st.lists(byte_changes(), max_size=1),
)
def test_a_spoiled_answer_or_truth_is_read_or_refused(
    tmp_path: Path,
    sound: dict[str, Any],
    read: Callable[[Path], Any],
    table: list[Callable[[Any], Any]],
    content: list[Change],
) -> None:
    """Every number that comes through is finite."""
    path = tmp_path / ("diagnosis.json" if read is read_open else "c001.json")
    (tmp_path / "model.toml").write_text(tomli_w.dumps(MODEL))
    path.write_bytes(spoiled(rewritten(sound, table, json.dumps), content))
    made = accepted(read, path)
    if made is not None and read is read_diagnosis:
        numbers = [p.value for cause in made.effects for p in cause.parameters.values()]
        assert np.all(np.isfinite([made.wall_time_s, *numbers]))


@pytest.mark.parametrize("kind", REPLACEMENTS)
@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("run.csv", read_finger),
        ("model.toml", load_model),
        ("dataset.toml", read_whole),
        ("train.csv", lambda path: read_whole(path.parent / "dataset.toml")),
        ("c001.json", read_truth),
        ("diagnosis.json", read_diagnosis),
    ],
)
def test_another_thing_in_a_files_place_is_refused(
    name: str, read: Callable[[Path], Any], kind: str, tmp_path: Path
) -> None:
    """Folders, loops, pipes, nothing, empty files and files that cannot be read: one error."""
    dataset(tmp_path)
    (tmp_path / name).touch()
    replace_file(tmp_path / name, kind)
    assert accepted(read, tmp_path / name) is None
