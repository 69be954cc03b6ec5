"""A kernel is compiled once: the next process finds its binary."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
REPLAY = """
from tendon_newton.data.model_file import load_model
from tendon_newton.simulation.hosts.replay import replay
from tests.physics.runs import run_of

replay([run_of([[0.0], [0.5]])], load_model("examples/hidden_friction/model.toml"))
"""


@pytest.mark.slow
def test_a_second_process_compiles_nothing(tmp_path: Path) -> None:
    """In the first one a kernel was compiled before another that calls the same functions."""
    known = {**os.environ, "WARP_CACHE_PATH": str(tmp_path)}
    found = []
    for _ in range(2):
        subprocess.run([sys.executable, "-c", REPLAY], cwd=ROOT, env=known, check=True)
        found.append({path.name for path in tmp_path.rglob("*.o")})
    assert found[0] == found[1] != set()
