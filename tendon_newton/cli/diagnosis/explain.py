"""Say why a diagnosis named a cause or did not, and what would tell.

Without CAUSE every cause that was tried stands on one line: its name, the share of the gap that
it explains alone, and what became of it. With CAUSE the whole account is told.

A cause is named if it makes the residuals smaller by what is asked of it, also on parts of the
data that no number had seen, and if its numbers end inside their ranges. All named causes
together must leave little. A cause that explains much alone may add nothing to better ones.

Example: tendon-newton explain results speed_limit
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import unknown_name

if TYPE_CHECKING:
    from tendon_newton.diagnosis.accounts.account_file import Accounts

WIDTH = 100  # Letters in a line of sentences.


@dataclass(frozen=True, kw_only=True)
class ExplainConfig:
    """Which diagnosis to explain, and which cause of it."""

    diagnosis: Annotated[Path, tyro.conf.Positional]
    """Folder that the verb diagnose wrote, or its diagnosis.json."""
    cause: Annotated[str | None, tyro.conf.Positional] = None
    """Cause to explain, as the list has it; all of them on one line each without it."""


def main(config: ExplainConfig) -> None:
    """Print the list, or the account of one cause."""
    quiet_warp()

    from tendon_newton.diagnosis.accounts.account_file import read_accounts

    accounts = read_accounts(config.diagnosis)
    print(overview(accounts) if config.cause is None else account(accounts, config.cause))


def overview(accounts: Accounts) -> str:
    """Return every cause on one line."""
    from tendon_newton.diagnosis.accounts.account_words import line

    head = f"  {'cause':28s} {'alone':>6s}  what became of it"
    verdict = accounts.stated.verdict.replace("_", " ")
    rows = [f"  {line(cause)}" for cause in accounts.causes]
    return "\n".join([f"verdict: {verdict}", "", head, *rows])


def account(accounts: Accounts, name: str) -> str:
    """Return the account of one cause."""
    from tendon_newton.data.servo_names import effect_of
    from tendon_newton.diagnosis.accounts.account_words import not_tried, sentences
    from tendon_newton.diagnosis.report_words import cause_text
    from tendon_newton.effects import EFFECTS

    cause, start = accounts.find(name), accounts.stated.start
    told: list[str] = []
    if name in start:
        known = cause_text(name, start[name], accounts.scale)
        told = [f"The model that was started from has it: {known}. More of it was looked for."]
    if cause is not None:
        told += sentences(cause)
    elif not told:
        if effect_of(name) not in EFFECTS:
            raise unknown_name("cause", name, [c.name for c in accounts.causes])
        told = not_tried(name, has_force=accounts.has_force, servos=accounts.servos)
    return "\n".join(textwrap.fill(sentence, WIDTH, subsequent_indent="  ") for sentence in told)
