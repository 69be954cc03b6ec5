"""The score of predictions that any program made."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.studies.board import floors, interval, measured, scores
from tendon_newton.data.formats.csv_file import write_columns
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording
from tests.physics.runs import led, run_of

PATH = np.linspace(0.0, 2.0, 81)


def predicted(folder: Path, recording: Recording, **signals: np.ndarray) -> Path:
    """Write what a program predicts at instants of its own."""
    time = np.linspace(recording.time[0], recording.time[-1], 500)
    columns = {n: np.interp(time, recording.time, x) for n, x in signals.items()}
    write_columns(folder / Path(recording.name).with_suffix(".csv").name, {"t": time, **columns})
    return folder


def test_a_wrong_zero_is_the_error(tmp_path: Path) -> None:
    """A prediction that is 3 mrad and 20 mN off has these errors, at any instants."""
    recording = replace(led(PATH, -PATH), force=PATH[:, None], joint_position=0.5 * PATH)
    signals = {"force": PATH - 0.02, "joint_angle": 0.5 * PATH + 0.003}
    found = scores((recording,), predicted(tmp_path, recording, **signals))
    assert set(found) == {"force", "joint_angle"}
    assert found["force"] == pytest.approx([20.0])
    assert found["joint_angle"] == pytest.approx([3.0])


def test_what_drives_a_simulation_is_no_prediction() -> None:
    """A commanded servo predicts its angle, a path does not."""
    assert set(measured(run_of(PATH))) == {"theta"}
    assert set(measured(led(PATH, PATH))) == {"force", "joint_angle"}


def test_a_prediction_that_cannot_be_scored_is_refused(tmp_path: Path) -> None:
    """No signal of ours, or an end before the recording's."""
    recording = run_of(PATH)
    with pytest.raises(InvalidRecording, match="a prediction is a CSV file"):
        scores((recording,), tmp_path)
    (tmp_path / recording.name).with_suffix(".csv").write_text("1,2\n3,4\n")
    with pytest.raises(InvalidRecording, match="a prediction has a column t"):
        scores((recording,), tmp_path)
    with pytest.raises(InvalidRecording, match="a prediction has one of theta; it has t, torque"):
        scores((recording,), predicted(tmp_path, recording, torque=PATH))
    longer = run_of(np.linspace(0.0, 2.0, 161))
    with pytest.raises(InvalidRecording, match="t must reach from 0 to 2 s"):
        scores((longer,), predicted(tmp_path, recording, theta=PATH))


def test_the_floor_is_what_repeats_differ_by_once_they_have_moved() -> None:
    """Twice 3 mrad either side of a mean; where a run begins is not counted."""
    rest = np.concatenate([np.zeros(20), PATH])
    first = replace(run_of(rest), name="first.mcap")
    apart = np.where(np.arange(len(rest)) < 20, 0.5, 0.006)[:, None]
    second = replace(first, name="second.mcap", motor_position=first.motor_position + apart)
    assert floors([first]) == {}
    assert floors([first, second]) == {"theta": pytest.approx(6.0 / np.sqrt(2.0), rel=1e-2)}


def test_an_interval_holds_the_score() -> None:
    """Drawn over recordings, it lies around their RMS."""
    sizes = np.array([1.0, 2.0, 2.0, 3.0])
    low, high = interval(sizes)
    assert 1.0 <= low < np.sqrt((sizes**2).mean()) < high <= 3.0
