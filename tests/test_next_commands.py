"""Every command that a verb prints at its end is typed, and so is what that one prints."""

import pytest

from tests.doors.logs import Columns, csv_logs, lerobot, lone, own_dataset, sound
from tests.doors.mistakes import FAILED
from tests.proposed import walk


def lone_runs() -> list[Columns]:
    """Return two sound runs of one joint."""
    out = [sound(0), sound(1)]
    for run in out:
        lone(run)
    return out


def failed_runs() -> list[Columns]:
    """Return two runs of two joints, of which one reads 0 where its bus failed."""
    out = [sound(0), sound(1)]
    for run in out:
        run["q_0"][FAILED] = 0.0
    return out


@pytest.mark.parametrize(
    ("start", "verbs"),
    [
        (lambda folder: csv_logs()(folder, lone_runs()), ["import", "diagnose", "explain"]),
        (
            lambda folder: lerobot(folder, failed_runs()),
            ["doctor", "diagnose", "explain", "explain"],
        ),
        (lambda folder: own_dataset(folder, failed_runs()), ["doctor", "doctor"]),
        (lambda folder: ["train-policy", "--out", "policy"], ["train-policy", "evaluate-policy"]),
    ],
    ids=["logs", "lerobot", "failed reads", "policy"],
)
def test_what_is_printed_last_can_be_typed(start, verbs, tmp_path, monkeypatch) -> None:
    """From a first command to the end of all that follow, as they stand."""
    monkeypatch.chdir(tmp_path)
    assert walk(start(tmp_path)) == verbs
