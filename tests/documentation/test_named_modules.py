"""Programs that pages, docstrings and messages tell a reader to run."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"python3? -m ((?:tendon_newton|train|hardware|examples|tests)\b[\w.]*)")
TEXTS = (".md", ".py", ".yml", ".html", ".toml")


def named_modules() -> dict[str, list[str]]:
    """Return each module that some text tells to run, with the files that say so."""
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    found: dict[str, list[str]] = {}
    for name in listed:
        path = ROOT / name
        if path.is_file() and (path.suffix in TEXTS or path.name == "Makefile"):
            for module in NAMED.findall(path.read_text(encoding="utf-8")):
                found.setdefault(module.rstrip("."), []).append(name)
    return found


@pytest.mark.parametrize(("module", "files"), named_modules().items())
def test_every_module_that_a_text_names_runs(module: str, files: list[str]) -> None:
    """It is a package with ``__main__.py``, or a file that does something when it is run."""
    place = ROOT.joinpath(*module.split("."))
    program = place / "__main__.py" if place.is_dir() else place.with_suffix(".py")
    assert program.is_file(), f"no {module}; named in {', '.join(files)}"
    if not place.is_dir():
        assert "__main__" in program.read_text(encoding="utf-8"), f"{module} does nothing"
