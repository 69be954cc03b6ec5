"""Logs: what is fitted, what only reports, and which files may come."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.files.ledger import Ledger
from tendon_newton.errors import InvalidDataset, InvalidOutput
from tendon_newton.identification.cutting import hold_out
from tendon_train.refresh.refresh_logs import (
    BEGINNING,
    LOOSE,
    REST,
    SETTLING,
    log_files,
    logs_as_dataset,
    read_logs,
    taut_parts,
    without_beginning,
    without_rest,
)

EXAMPLE = Path(__file__).parents[3] / "examples" / "hidden_friction"


def test_the_end_of_every_log_is_held_out() -> None:
    """Two thirds are fitted and one reports, but for the beginning and where a tendon is loose."""
    for log in read_logs([EXAMPLE / "finger_sine_0.csv", EXAMPLE / "finger_stairs_1.csv"]):
        dataset = logs_as_dataset(EXAMPLE, [log])
        cut = log.time[0] + BEGINNING + (log.duration - BEGINNING) * 2.0 / 3.0
        for part in (*dataset.train, *dataset.test):
            assert part.start == "first_row"
            assert part.force is None, "a load cell is left out"
        assert max(part.time[-1] for part in dataset.train) <= cut + 0.05  # four rows
        assert min(part.time[0] for part in dataset.test) >= cut - 0.05
        assert min(part.time[0] for part in dataset.train) >= log.time[0] + BEGINNING
        assert {part.name for part in dataset.test} == {f"{log.name} (end)"}


def test_what_lies_between_loose_rows_is_kept_if_it_is_long_enough() -> None:
    """A second and more, row for row; a log that never is taut stays as it is."""
    (log,) = read_logs([EXAMPLE / "finger_sine_0.csv"])
    log = without_beginning(log)
    angle = np.full_like(log.motor_position, LOOSE + 0.1)
    angle[100:110] = angle[150:160] = LOOSE
    first, last = taut_parts([replace(log, motor_position=angle)])
    assert first.time.tolist() == log.time[:100].tolist()
    assert last.time.tolist() == log.time[160:].tolist()
    loose = replace(log, motor_position=0.0 * angle)
    assert taut_parts([loose]) == (loose,)


def test_what_follows_the_policy_is_left_out() -> None:
    """On the way home the servo turns the spool, and the finger no longer follows."""
    path = EXAMPLE / "finger_sine_0.csv"
    (whole,), (cut,) = read_logs([path]), read_logs([path], lambda log: 3.0)
    rows = int(np.sum(whole.time - whole.time[0] < 3.0))
    assert cut.time.tolist() == whole.time[:rows].tolist()
    assert (cut.name, cut.start) == (whole.name, whole.start)


def test_a_rest_at_the_end_scores_nothing() -> None:
    """A second of it stays, in which friction shows; a log that never moves stays whole."""
    (log,) = read_logs([EXAMPLE / "finger_sine_0.csv"])
    angle = log.motor_position.copy()
    angle[400:] = angle[399] + 0.5 * REST
    resting = replace(log, motor_position=angle)
    moving = int(np.flatnonzero(np.abs(angle - angle[-1]).max(axis=1) > REST)[-1])
    cut = without_rest(resting)
    assert cut.time[-1] == pytest.approx(log.time[moving] + SETTLING, abs=0.02)
    still = replace(log, motor_position=0.0 * angle)
    assert without_rest(still) is still


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
    with pytest.raises(InvalidDataset, match="nowhere: no such log of a deployment"):
        log_files((tmp_path / "nowhere",))


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    """Results come back as they were written, tuples as lists."""
    first = Ledger(tmp_path / "refresh.json", {"model": "ab", "logs": ("a", "b")})
    assert first.done("drift") is None
    first.finish("drift", {"verdict": "worn", "causes": ("x",)})
    again = Ledger(tmp_path / "refresh.json", {"model": "ab", "logs": ("a", "b")})
    assert again.done("drift") == {"verdict": "worn", "causes": ["x"]}
    assert again.done("training") is None


def test_other_inputs_are_refused(tmp_path: Path) -> None:
    """The message says what differs; so is a file that is none."""
    path = tmp_path / "refresh.json"
    Ledger(path, {"model": "ab"}).finish("drift", {})
    with pytest.raises(InvalidOutput, match="began with model = 'ab', and now it is 'cd'"):
        Ledger(path, {"model": "cd"})
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InvalidOutput, match="must be JSON"):
        Ledger(path, {"model": "ab"})


def test_a_ledger_without_a_place_is_named(tmp_path: Path) -> None:
    """A folder that is not there."""
    with pytest.raises(InvalidOutput, match="nowhere"):
        Ledger(tmp_path / "nowhere" / "refresh.json", {}).finish("drift", {})
