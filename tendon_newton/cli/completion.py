"""Completion of verbs and options by a shell, made from the verbs' own options."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any, Union

import tyro

from tendon_newton.cli import config_of
from tendon_newton.errors import unknown_name

SHELLS = ("bash", "zsh", "tcsh")


def print_completion(shell: str, verbs: Mapping[str, str]) -> None:
    """Print the script that a shell reads at its start.

    Args:
        verbs: Name -> module of each verb.
    """
    if shell not in SHELLS:
        raise unknown_name("shell with completion", shell, SHELLS)
    kinds: list[Any] = []
    for verb, path in verbs.items():
        config = config_of(path)
        kinds.append(Annotated[config, tyro.conf.subcommand(verb, prefix_name=False)])
    every: Any = Union[tuple(kinds)]  # noqa: UP007  # the members are known when this runs
    with suppress(SystemExit):  # tyro prints and leaves
        tyro.cli(
            every,
            prog="tendon-newton",
            args=["--tyro-print-completion", shell],
            config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes),
        )
