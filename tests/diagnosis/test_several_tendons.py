"""A diagnosis is that of one tendon, and says so before it begins."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import write_dataset
from tests.importers.logs import model, recording


@pytest.mark.parametrize("several", ["train", "test"])
def test_a_recording_of_two_tendons_is_refused(
    several: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In either split: one line that names it, its bench and how many there are."""
    both = {"bench": "finger_antagonist", "force": np.full((20, 2), 2.0)} | {
        name: np.full((20, 2), 0.5) for name in ("command", "motor_position", "motor_velocity")
    }
    train, test = (
        recording(f"{name}.csv", **(both if name == several else {})) for name in ("train", "test")
    )
    write_dataset(tmp_path / "data", [train], [test])
    words = ["--model", str(model(tmp_path / "model.toml")), "--out", str(tmp_path / "out")]
    assert main(["diagnose", str(tmp_path / "data"), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{several}.csv: a recording to be diagnosed or fitted has one tendon" in line
    assert line.endswith("of finger_antagonist has 2")
