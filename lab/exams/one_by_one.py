"""An exam from the command line: cases drawn from a seed and answered one after the other."""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from tendon_newton.data.files.text_file import write_text

Case = TypeVar("Case")
Row = dict[str, Any]  # What was drawn and what was told of one case


def main(
    about: str | None,
    each: tuple[int, str],
    draw: Callable[[int, int], Iterable[Case]],
    answer: Callable[[Case], Row],
    score: Callable[[Sequence[Row]], Row],
) -> None:
    """Draw, tell, score and write.

    Args:
        about: What the exam asks, for its help.
        each: How many cases there are of each kind unless told, and what these are called.
        draw: Returns the cases of a seed, so many of each kind.
        answer: Answers one case.
        score: Counts the answers.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--each", type=int, default=each[0], help=each[1])
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    rows: list[Row] = []
    for case in draw(chosen.seed, chosen.each):
        rows.append(answer(case))
        say(json.dumps(rows[-1]))
    figures = {"seed": chosen.seed, "each": chosen.each, **score(rows), "rows": rows}
    write_text(chosen.out, json.dumps(figures, indent=1) + "\n")
    say(json.dumps(score(rows), indent=1))


def say(text: str) -> None:
    """Print at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
