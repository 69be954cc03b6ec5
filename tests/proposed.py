"""Commands that a verb prints for its user to type next."""

import contextlib
import io
import re
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, get_type_hints

import tyro

from tendon_newton.cli import VERBS, main

COMMAND = re.compile(r"tendon-newton ([a-z].*?)(?: \(.*)?$", re.MULTILINE)
READ = ("dataset", "diagnosis", "model", "policies", "source", "log")  # Options that name files
STATED = "ASSET"  # Stands in a command for a file that the user alone has
FOUND_FAULTS = {"doctor": 1}  # Exit code of a verb that found faults
SMALL = {
    "diagnose": ("--budget", "2s"),
    "export": ("--seconds", "1"),
    "train-policy": (
        *("--worlds", "8", "--steps", "4", "--batch", "16", "--max-step", "2e-3"),
        *("--episode", "1", "--iterations", "1"),
    ),
    "evaluate-policy": ("--worlds", "2", "--seconds", "1", "--no-plots"),
}
"""What makes a command short, by its verb."""


def proposed(said: str) -> list[list[str]]:
    """Return the words of every command in a text; each verb takes its own, on files that exist."""
    found = [shlex.split(command) for command in COMMAND.findall(said)]
    for verb, *words in found:
        config: Any = tyro.cli(
            get_type_hints(import_module(VERBS[verb]).main)["config"], args=words
        )
        files = [getattr(config, key, None) for key in READ]
        files = [one for each in files for one in (each if isinstance(each, tuple) else (each,))]
        assert all(file is None or Path(file).exists() for file in files), (verb, words)
    return found


def walk(words: Sequence[str]) -> list[str]:
    """Type a command and all that follow from what is printed, each once; return their verbs."""
    typed: list[list[str]] = []
    waiting = [list(words)]
    while waiting:
        typed.append(waiting.pop(0))
        verb, *_ = typed[-1]
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = main([*typed[-1], *SMALL.get(verb, ())])
        sys.stdout.write(said.getvalue())
        assert code in (0, FOUND_FAULTS.get(verb, 0)), (typed[-1], said.getvalue())
        waiting += [
            one
            for one in proposed(said.getvalue())
            if one not in (*typed, *waiting) and STATED not in one
        ]
    return [verb for verb, *_ in typed]
