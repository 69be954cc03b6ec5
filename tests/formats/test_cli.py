"""What the command line does before and after a verb."""

import os
import subprocess
import sys
from types import ModuleType

import pytest

from tendon_newton import cli
from tendon_newton.cli import VERBS, main

HEAVY = ("warp", "newton", "torch", "pxr", "matplotlib", "scipy")


def help_in_a_fresh_interpreter(arguments: list[str]) -> set[str]:
    """Run the command line with these arguments and return which heavy packages it loaded."""
    code = (
        "import sys\nfrom tendon_newton.cli import main\n"
        f"assert main({arguments!r}) == 0\n"
        f"print('LOADED', *(set({HEAVY!r}) & sys.modules.keys()))"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    return set(result.stdout.splitlines()[-1].split()[1:])


@pytest.mark.parametrize("arguments", [["--help"], *([verb, "--help"] for verb in VERBS)])
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    """Help answers without the simulator, also where it is not installed."""
    assert help_in_a_fresh_interpreter(arguments) == set()


def test_every_verb_stands_in_the_overview(capsys: pytest.CaptureFixture[str]) -> None:
    """Each verb has a line that says what it does."""
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for verb in VERBS:
        assert any(line.split()[:1] == [verb] and len(line.split()) > 3 for line in lines)


def test_a_misspelt_verb_gets_a_suggestion(capsys: pytest.CaptureFixture[str]) -> None:
    """The nearest verb is offered, on one line of stderr."""
    assert main(["diagnoze"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
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
def test_no_traceback_reaches_the_user(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    said: str,
) -> None:
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
