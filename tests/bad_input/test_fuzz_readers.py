"""Whatever a file holds, its reader returns a valid object or one of our errors.

Every file begins sound and is spoilt up to three times. A library's exception, a hang, a message
that repeats the junk, a gigabyte and a look into another file are all failures. `python -m
tests.fuzz` does the same with as many files as one likes.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tendon_lab.exam.truth_file import read_truth
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.formats.csv_file import read_csv
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.errors import TendonNewtonError
from tests.fuzz.command import fuzz
from tests.fuzz.mutations import REPLACEMENTS, replace_file
from tests.fuzz.targets import GROUPS
from tests.importers.logs import dataset

FILES = 500


@pytest.mark.slow
def test_spoilt_files_of_every_format_are_read_or_refused() -> None:
    """Five hundred, and of every format some are refused, so that the spoiling is worth it."""
    tally = fuzz(FILES)
    assert tally.failures == []
    assert tally.files > 0.9 * FILES
    assert set(tally.outcomes) == {name for targets in GROUPS.values() for name in targets()}
    refused = {name for name, counts in tally.outcomes.items() if counts["refused"]}
    assert len(refused) > 0.8 * len(tally.outcomes)


def read_finger(path: Path) -> Recording:
    """Read a CSV file as a log of the finger."""
    return read_csv(path, bench="finger")


def read_whole(path: Path) -> Dataset:
    """Read a dataset that may lack a split."""
    return load_dataset(path.parent, require_train=False, require_test=False)


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
    with pytest.raises(TendonNewtonError) as refusal:
        read(tmp_path / name)
    assert (tmp_path / name).stem in str(refusal.value)
