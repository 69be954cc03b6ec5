"""The README's commands, from top to bottom in one folder, as they are written."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tests.interpreters import python, search_path

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"```(sh|python)\n(.*?)```", re.DOTALL)
SHORT = ("doctor", "collect", "calibrate", "plot", "asset")
"""Verbs that answer within seconds; a deployment too, of the policy that comes along."""


def blocks() -> list[tuple[str, str]]:
    """Return language and text of each block, in order."""
    return BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))


def commands() -> list[list[str]]:
    """Return the words of each command of the shell blocks, in order."""
    lines = [line for kind, text in blocks() if kind == "sh" for line in text.splitlines()]
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def is_short(words: list[str]) -> bool:
    """Tell whether a command needs neither a compiler nor an earlier long one."""
    return words[1] in SHORT or (words[1] == "deploy" and "finger-stairs" in words)


def test_the_page_is_short_and_each_command_has_its_time() -> None:
    """At most 900 words; a reader knows before each command how long it takes."""
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 900
    lines = [line for kind, text in blocks() if kind == "sh" for line in text.splitlines()]
    assert [line for line in lines if not re.search(r"#.*(?:\d (?:s|min)|minute)\b", line)] == []


def test_the_short_commands_run_in_their_order(tmp_path, monkeypatch) -> None:
    """Bench, recordings with their model, a policy that comes along, a finger: no error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    short = [words for words in commands() if is_short(words)]
    assert len(short) > 6
    for words in short:
        assert main(words[1:]) == 0, words
    for file in ("recordings/model.toml", "cell.toml", "deployments/finger-stairs_0.svg"):
        assert (tmp_path / file).stat().st_size > 0


@pytest.mark.slow
def test_the_readme_runs_from_top_to_bottom(tmp_path: Path) -> None:
    """In one empty folder, by a shell, without any change."""
    python = Path(sys.executable)
    path = os.pathsep.join([str(python.parent), os.environ["PATH"]])
    known = {**os.environ, "PATH": path, "PYTHONPATH": search_path(ROOT), "OMP_NUM_THREADS": "1"}
    said = ""
    for kind, text in blocks():
        program = ["bash", "-ec"] if kind == "sh" else [sys.executable, "-c"]
        run = subprocess.run(
            [*program, text], cwd=tmp_path, env=known, capture_output=True, text=True
        )
        assert run.returncode == 0, f"{text}\n{run.stdout[-2000:]}\n{run.stderr[-2000:]}"
        assert "Traceback" not in run.stderr
        said += run.stdout
    assert said.count("viscous_friction") >= 2, "of the demo and of the Python block"
    for file in ("demo/report.html", "diagnosis/report.html", "run.csv", "worn/dataset.toml"):
        if file != "run.csv" or "no run is needed" not in said:
            assert (tmp_path / file).stat().st_size > 0, file


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
    run = python("-c", code, cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    found = re.search(r"viscous_friction coefficient: ([\d.]+)", run.stdout)
    assert float(found[1]) == pytest.approx(0.810, abs=0.02)
    errors = dict(re.findall(r"(nominal|extended): ([\d.]+) N RMS", run.stdout))
    assert float(errors["extended"]) < 0.06 < 0.5 * float(errors["nominal"])
