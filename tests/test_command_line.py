"""The door: words of --help, and --quiet."""

import re
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from typing import get_args

import pytest

from tendon_newton.cli import config_of, every_verb, main

# Abbreviations, names in examples, and what a help text says of another verb's arguments
KNOWN = {"CSV", "JSON", "ROS", "USD", "README", "CPU", "GPU", "SIGTERM", "ROBOTIS"}
KNOWN |= {"NAME", "PORT", "RECORDING", "MENDED", "DATASET"}


@pytest.mark.parametrize("verb", every_verb())
def test_words_in_capitals_are_names_of_options(verb: str, capsys) -> None:
    """Of `--help`: each is an argument's, an option's, or an abbreviation that all know."""
    module = import_module(every_verb()[verb])
    config = config_of(module.__name__)
    kinds = get_args(config) or (config,)
    names = {field.name.upper() for kind in kinds for field in fields(kind)}
    assert set(re.findall(r"\b[A-Z]{2,}\b", module.__doc__)) - names <= KNOWN
    assert main([verb, "--help"]) == 0
    said = capsys.readouterr().out
    assert "{None}" not in said
    if verb != "asset":
        positional = [f.name for f in fields(config) if "Positional" in str(f.type)]
        assert all(name.upper() in said for name in positional)


def test_a_quiet_verb_prints_nothing_but_warnings_and_errors(tmp_path, capfd) -> None:
    """What an operator must hear goes to the error stream, as errors do; the files are the same."""
    words = ["collect", "--port", "virtual", "--faster-than-real-time", "--duration", "2"]
    assert main([*words, "--out", str(tmp_path / "a")]) == 0
    assert "rows, 0 missed" in capfd.readouterr().out
    assert main([*words, "--quiet", "--out", str(tmp_path / "b")]) == 0
    assert capfd.readouterr() == ("", "")
    name = "finger_random_steps_0.mcap"
    assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert main([*words, "--quiet", "--force-limit", "0.5", "--out", str(tmp_path / "c")]) == 2
    said = capfd.readouterr()
    assert said.out == ""
    assert "tension" in said.err


def test_a_start_does_not_look_through_all_that_it_loads_again_and_again() -> None:
    """Python's full searches for dead objects, each 0.1 s and more: none, and not seven.

    Nor does an end: what is loaded is left out of the two searches there, which take 2 s.
    """
    code = (
        "import atexit, gc; left = lambda: print(gc.get_freeze_count() > 100_000); "
        "atexit.register(left); from tendon_newton.cli import main; "
        "main(['asset', 'check', 'finger']); print(gc.get_stats()[2]['collections'])"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert printed.stdout.split()[-2:] == [b"0", b"True"]
