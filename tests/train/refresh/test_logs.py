"""Logs: what is fitted, what only reports, and which files may come."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.errors import InvalidDataset
from tendon_newton.identification.cutting import hold_out
from train.refresh.logs import BEGINNING, log_files, logs_as_dataset, read_logs

EXAMPLE = Path(__file__).parents[3] / "examples" / "hidden_friction"


def test_the_end_of_every_log_is_held_out() -> None:
    """Train and test have every row once but the first two seconds, where a tendon may be loose."""
    logs = read_logs([EXAMPLE / "finger_sine_0.csv", EXAMPLE / "finger_stairs_1.csv"])
    dataset = logs_as_dataset(EXAMPLE, logs)
    for log, fitted, held in zip(logs, dataset.train, dataset.test, strict=True):
        kept = log.time[log.time >= log.time[0] + BEGINNING]
        assert np.concatenate([fitted.time, held.time]).tolist() == kept.tolist()
        assert held.duration == pytest.approx((log.duration - BEGINNING) / 3.0, abs=0.05)
        assert (fitted.start, held.start) == ("first_row", "first_row")
        assert held.name == f"{log.name} (end)"
        assert held.force is None, "a load cell is left out"


def test_what_follows_the_policy_is_left_out() -> None:
    """On the way home the servo turns the spool, and the finger no longer follows."""
    path = EXAMPLE / "finger_sine_0.csv"
    (whole,), (cut,) = read_logs([path]), read_logs([path], lambda log: 3.0)
    rows = int(np.sum(whole.time - whole.time[0] < 3.0))
    assert cut.time.tolist() == whole.time[:rows].tolist()
    assert (cut.name, cut.start) == (whole.name, whole.start)


def test_a_log_that_is_too_short_to_be_cut_is_refused() -> None:
    """Two seconds a part, at least."""
    (log,) = read_logs([EXAMPLE / "finger_sine_0.csv"])
    with pytest.raises(InvalidDataset, match="two parts of 2 s or more"):
        hold_out([log], 0.999)


def test_logs_come_as_folders_or_as_files_that_a_folder_lists() -> None:
    """Both name the same files, in the order of the list."""
    whole = read_logs([EXAMPLE])
    assert {log.name for log in whole} == {path.name for path in log_files([EXAMPLE])}
    one = EXAMPLE / "spring_weak_ramp_0.csv"
    assert log_files([one]) == (one,)
    with pytest.raises(InvalidDataset, match=r"a log must be listed in .*dataset\.toml"):
        read_logs([EXAMPLE / "model.toml"])
    with pytest.raises(InvalidDataset, match="needs the log of a deployment"):
        read_logs([])


def test_a_log_that_is_not_there_is_named(tmp_path: Path) -> None:
    """Before anything is hashed or trained."""
    with pytest.raises(InvalidDataset, match="nowhere: the log of a deployment"):
        log_files((tmp_path / "nowhere",))
