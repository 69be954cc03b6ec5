"""What the command line does before and after a verb."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path
from types import ModuleType

import pytest

from tendon_newton import cli
from tendon_newton.cli import VERBOSE_OPTION, VERBOSE_SHORT, every_verb, main
from tests.bad_input.damage import refusal
from tests.held_out import small_dataset
from tests.interpreters import python, run_without


@pytest.mark.parametrize("arguments", [["--help"], *([verb, "--help"] for verb in every_verb())])
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    """Help answers without the simulator, also where it is not installed."""
    run_without(f"from tendon_newton.cli import main\nassert main({arguments!r}) == 0")


def test_every_verb_stands_in_the_overview(capsys: pytest.CaptureFixture[str]) -> None:
    """Each verb has a line that says what it does."""
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for verb in every_verb():
        assert any(line.split()[:1] == [verb] and len(line.split()) > 3 for line in lines)


def test_a_misspelt_verb_gets_a_suggestion(capsys: pytest.CaptureFixture[str]) -> None:
    """The nearest verb is offered, on one line of stderr."""
    line = refusal(["diagnoze"], capsys)
    assert line.startswith("error: No verb named 'diagnoze'; did you mean 'diagnose'? known: ")


def test_no_verb_shows_the_overview_and_is_misuse(capsys: pytest.CaptureFixture[str]) -> None:
    """A bare call is answered with the verbs and fails."""
    assert main([]) == 2
    assert "usage: tendon-newton VERB" in capsys.readouterr().out


def test_a_misspelt_option_is_misuse(capsys: pytest.CaptureFixture[str]) -> None:
    """What the option parser refuses exits with 2 as every misuse does."""
    assert main(["import", "xl330", "somewhere", "--outt", "x"]) == 2
    assert "--out" in capsys.readouterr().err


def verb_that_raises(error: BaseException) -> ModuleType:
    """A verb whose run ends with an error."""

    def run(config: int) -> None:
        raise error

    module = ModuleType("verb")
    vars(module)["main"] = run
    return module


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (PermissionError(13, "Permission denied", "out"), 2, "error: out: Permission denied"),
        (ModuleNotFoundError("no", name="warp"), 2, "error: asset needs the package 'warp'"),
    ],
)
def test_no_traceback_reaches_the_user(monkeypatch, capsys, error, code, said) -> None:
    """Interrupts, the system's refusals and missing packages are one line each."""
    monkeypatch.setattr(cli.importlib, "import_module", lambda path: verb_that_raises(error))
    assert main(["asset", "1"]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(said)


def test_a_closed_pipe_is_quiet() -> None:
    """``tendon-newton --help | true`` prints no complaint."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        result = subprocess.run(
            [sys.executable, "-m", "tendon_newton", "--help"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    assert (result.returncode, result.stderr) == (141, "")


def test_version_is_the_installed_one(capsys: pytest.CaptureFixture[str]) -> None:
    """``--version`` prints the version of the package."""
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip()[0].isdigit()


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
    return python("-S", "-m", "tendon_newton", *words, PYTHONPATH=paths)


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
    assert (out / "report.html").is_file()


def test_a_simulation_says_more_if_told(dataset: Path, tmp_path: Path) -> None:
    """Warp names itself and its devices, beside the answer."""
    words = ["simulate", dataset, "--model", dataset / "model.toml", "--no-plots"]
    run = python("-m", "tendon_newton", *words, "--out", tmp_path, VERBOSE_OPTION)
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
