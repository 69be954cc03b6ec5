"""Commands that a verb prints for its user to type next."""

import re
import shlex
from pathlib import Path
from typing import Any

import tyro

from tendon_newton.cli import config_of, every_verb

COMMAND = re.compile(r"tendon-newton ([a-z].*?)(?: \(.*)?$", re.MULTILINE)
READ = ("dataset", "diagnosis", "model", "policies", "source", "log")  # Options that name files


def proposed(said: str) -> list[list[str]]:
    """Return the words of every command in a text; each verb takes its own, on files that exist."""
    found = [shlex.split(command) for command in COMMAND.findall(said)]
    for verb, *words in found:
        config: Any = tyro.cli(config_of(every_verb()[verb]), args=words)
        files = [getattr(config, key, None) for key in READ]
        files = [one for each in files for one in (each if isinstance(each, tuple) else (each,))]
        assert all(file is None or Path(file).exists() for file in files), (verb, words)
    return found
