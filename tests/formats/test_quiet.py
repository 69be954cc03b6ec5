"""What a verb prints is its answer, also from a source tree that nobody installed."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tendon_newton.cli import VERBOSE_OPTION, VERBOSE_SHORT, main
from tests.held_out import small_dataset

ROOT = Path(__file__).resolve().parents[2]
CHATTER = ("Warp", "warning", "Warning", "sublayer", "Module ", "INFO")


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with every installed package but this one."""
    folder = tmp_path_factory.mktemp("libraries")
    for package in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if "tendon_newton" not in package.name and package.suffix != ".pth":
            (folder / package.name).symlink_to(package)
    return folder


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a dataset of fifteen seconds and its model."""
    return small_dataset(tmp_path_factory.mktemp("data"))


def from_source(libraries: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a verb of the source tree that is on the path; -S keeps installed packages off it."""
    paths = os.pathsep.join([str(ROOT), str(libraries)])
    return subprocess.run(
        [sys.executable, "-S", "-m", "tendon_newton", *map(str, words)],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_source_tree_knows_its_version(libraries: Path) -> None:
    """It is that of pyproject.toml, and where modules are loaded it is asked for no package."""
    run = from_source(libraries, "--version")
    assert (run.returncode, run.stderr) == (0, "")
    assert f'version = "{run.stdout.strip()}"' in (ROOT / "pyproject.toml").read_text()


def test_a_diagnosis_from_source_prints_its_answer_and_nothing_else(
    libraries: Path, dataset: Path, tmp_path: Path
) -> None:
    """No word of Warp about a GPU that is not there, none of USD about layers, no compilation."""
    model, out = dataset / "model.toml", tmp_path / "out"
    run = from_source(libraries, "diagnose", dataset, "--model", model, "--out", out)
    assert (run.returncode, run.stderr) == (0, "")
    assert not [word for word in CHATTER if word in run.stdout]
    assert (out / "identified.usda").is_file()


def test_a_simulation_says_more_if_told(dataset: Path, tmp_path: Path) -> None:
    """Warp names itself and its devices, beside the answer."""
    words = ["simulate", str(dataset), "--model", str(dataset / "model.toml"), "--no-plots"]
    run = subprocess.run(
        [sys.executable, "-m", "tendon_newton", *words, "--out", str(tmp_path), VERBOSE_OPTION],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0
    assert "wrote 3 recordings" in run.stdout
    assert "Warp" in run.stdout


@pytest.mark.parametrize("option", [VERBOSE_OPTION, VERBOSE_SHORT])
def test_both_spellings_ask_for_more(option: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The verb and the processes that it starts read the same variable."""
    monkeypatch.setenv("TENDON_NEWTON_VERBOSE", "")
    assert main(["plot", "nowhere.csv", option]) == 2
    assert os.environ["TENDON_NEWTON_VERBOSE"] == "1"


def test_what_native_code_says_besides_is_passed_on() -> None:
    """Only the line about a missing driver is kept back; an error on its way stays."""
    code = (
        "import os, warp as wp\n"
        "from tendon_newton.device_code.quiet import NO_DRIVER, quiet_warp\n"
        "def init():\n"
        "    os.write(2, b'Warp CUDA warning: ' + NO_DRIVER + b'.\\nthe disk is full\\n')\n"
        "wp.init = init\n"
        "quiet_warp()\n"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "the disk is full\n")
