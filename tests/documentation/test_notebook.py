"""The notebook of the demo runs from its first cell to its last, without Jupyter."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "examples" / "demo.ipynb"


def test_the_notebook_is_kept_without_what_it_printed() -> None:
    """A stored output would be older than the program; every cell has its name."""
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) > 3
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    assert len({cell["id"] for cell in cells}) == len(cells)


@pytest.mark.slow
def test_the_notebook_runs_and_names_the_friction(tmp_path: Path) -> None:
    """Cell by cell in one interpreter: 0.81 N s/rad, and the error falls to the noise of 0.05 N."""
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    found = re.search(r"viscous_friction coefficient: ([\d.]+)", run.stdout)
    assert found is not None
    assert float(found[1]) == pytest.approx(0.810, abs=0.02)
    errors = dict(re.findall(r"(nominal|extended): ([\d.]+) N RMS", run.stdout))
    assert float(errors["extended"]) < 0.06 < 0.5 * float(errors["nominal"])
