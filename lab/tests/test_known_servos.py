"""The servos that ship leave of logs that no fit has seen what their evidence says."""

import tarfile
from pathlib import Path

import pytest

from lab.studies.known_servos.__main__ import error, split_of
from lab.studies.known_servos.table import SERVOS, names, read_evidence
from tendon_newton.data.model_file import load_model


@pytest.mark.parametrize("name", names())
def test_a_known_servo_holds_its_error_on_logs_left_out(shared: Path, tmp_path, name: str) -> None:
    """To 2 %: simulations of other releases differ by as much where a pendulum tips over."""
    logs = shared / "data" / name
    if not logs.is_dir():
        pytest.skip("these logs are not part of the repository, and are not here")
    for archive in logs.glob("*.tar.xz"):
        with tarfile.open(archive) as packed:
            packed.extractall(tmp_path, filter="data")
        logs = next(tmp_path.rglob("*.json")).parent
    found = error(split_of(name, logs).test, load_model(SERVOS / name / "model.toml"))
    assert found == pytest.approx(read_evidence()[name]["held_out_mrad"], rel=0.02)
