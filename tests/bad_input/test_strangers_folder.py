"""No file of the folder that a program runs in is imported: it may have come with a download."""

import os
import re
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tendon_hardware.virtual_bench.process import VirtualPorts
from tendon_newton.data.files.guarded import guarded
from tendon_newton.scheduler import JobOptions, open_executor
from tests.interpreters import python
from tests.scheduling.jobs import squared

ROOT = Path(__file__).resolve().parents[2]
PRODUCT = ("tendon_newton", "train/tendon_train", "hardware/tendon_hardware", "lab/tendon_lab")
TRAP = "open(__file__ + '.sprung', 'w'); raise SystemExit(f'{__name__} of the current folder')\n"
OWN_START = {"tendon_newton/safe_path.py", "hardware/tendon_hardware/servos/serial_bus/keeper.py"}
"""Where a command line of this interpreter is made; the keeper's takes no path at all (-I -S)."""
SCHEDULER = "tendon_newton/scheduler.py"
"""Where an environment says the same, of a pool."""


@pytest.fixture
def traps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a trap for each module of the library, the packages and ours."""
    folder = tmp_path / "downloaded"
    folder.mkdir()
    loaded = {name.partition(".")[0] for name in sys.modules}
    names = {*sys.stdlib_module_names, *packages_distributions(), *loaded, "sitecustomize"}
    for name in filter(str.isidentifier, names - {"__main__"}):
        (folder / f"{name}.py").write_text(TRAP)
    monkeypatch.chdir(folder)
    return folder


def sprung(folder: Path) -> list[str]:
    """Return which traps were imported."""
    return sorted(path.name for path in folder.glob("*.sprung"))


def test_a_recording_on_a_virtual_bench_imports_none(traps: Path, tmp_path: Path) -> None:
    """The program and its bench are two interpreters."""
    program = tmp_path / "tendon-newton"  # as pip writes it
    program.write_text("import sys\nfrom tendon_newton.__main__ import main\nsys.exit(main())\n")
    words = ["collect", "--port", "virtual", "--duration", "1", "--out", "o"]
    run = python(program, *words, cwd=Path.cwd())
    assert sprung(traps) == [], run.stderr
    is_late = "no instruction came for" in run.stderr  # a busy machine's, which is right to stop
    assert run.returncode == 0 or is_late, run.stderr


def test_a_process_of_a_library_imports_none(traps: Path) -> None:
    """Whoever calls the packages from a program of his own gets the same children."""
    with open_executor(JobOptions(jobs=2)) as executor:
        assert executor.submit(squared, 3).result()[0] == 9
    assert guarded(os.path.basename, "a/b") == "b"
    with VirtualPorts("spring_weak") as bench:
        assert bench.state() is not None
    assert sprung(traps) == []


def test_only_one_place_says_how_python_is_started() -> None:
    """A further child process would else forget to leave out the current folder."""
    files = [path for part in PRODUCT for path in (ROOT / part).rglob("*.py")]
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in files}
    assert {file for file, text in texts.items() if "sys.executable" in text} == OWN_START
    pools = re.compile(r"ProcessPoolExecutor|get_context|set_start_method|os\.fork")
    assert {file for file, text in texts.items() if pools.search(text)} == {SCHEDULER}
    assert "with safe_children():" in texts[SCHEDULER]
