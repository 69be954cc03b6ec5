"""What the command line says of a mistake."""

import contextlib
import io
from pathlib import Path

from tendon_newton.cli import main
from tests.doors.files import FILES
from tests.doors.logs import Columns, Door, sound
from tests.doors.mistakes import MISTAKES, Mistake
from tests.proposed import proposed

EVERY = (*MISTAKES, *FILES)


def spoiled_runs(mistake: Mistake) -> list[Columns]:
    """Return two runs in which a mistake was made."""
    runs = [sound(0), sound(1)]
    for run in runs:
        mistake.spoil(run)
    return runs


def lines_said(folder: Path, door: Door, runs: list[Columns]) -> list[str]:
    """Take runs in by a door, and return the lines that are printed."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        main(door(folder, runs))
    proposed(said.getvalue())
    return said.getvalue().replace(str(folder), ".").splitlines()
