"""Tables of the comparison."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean, median
from typing import Any

import numpy as np

from lab.results.cells import table

REPEATS, OURS, TOLD, ARM = "repeats", "ours, diagnosed", "told", "so101"
LEVEL = 1.05  # Ratio of errors up to which two models are level
ROWS = {
    REPEATS: "repeats of the same motion: no model can do better",
    "data sheet": "data sheet, nothing fitted",
    "four numbers": "lag, delay, deadband and offset, no physics",
    **{f"bam m{k}": f"Rhoban/bam m{k}" for k in range(1, 7)},
}
"""Rows, in order, with their words; then come plain models of ours, by their names."""
OTHERS = tuple(f"bam m{k}" for k in range(1, 7))
"""Rows of other people's programs."""

HERE = "lab/studies/comparison"
PARTS = ("diagnosis", "identification", "simulation", "effects", "actuators", "data")
OF_OURS = (*(f"tendon_newton/{part}" for part in PARTS), f"{HERE}/splits.py",
           "lab/studies/so101_pairs.py")  # fmt: skip
"""Code that decides a row of ours."""


def rests_on(row: str) -> tuple[str, ...]:
    """Return the files and folders that decide a row."""
    if row.startswith("bam "):
        return (f"{HERE}/bam.py", f"{HERE}/bam_search.py", f"{HERE}/splits.py")
    if row == REPEATS:
        return (f"{HERE}/splits.py", "lab/studies/sts3215.py")
    return (f"{HERE}/four_numbers.py", *OF_OURS) if row == "four numbers" else OF_OURS


Results = Mapping[str, Mapping[str, Mapping[str, Any]]]


def tables(results: Results) -> str:
    """Return one table for each servo that stands alone."""
    servos = [s for s in dict.fromkeys(key.split(":")[0] for key in results) if s != ARM]
    return "\n\n".join(
        part
        for servo in servos
        for keys in [[key for key in results if key.startswith(f"{servo}:")]]
        for part in (f"### {servo.upper()}", errors(results, keys))
    )


def errors(results: Results, keys: Sequence[str]) -> str:
    """Return held-out errors [mrad], with numbers and time of a fit on the first split."""
    single = [key for key in keys if " and " not in key]
    pairs = [key for key in keys if key not in single]
    splits = [key.split(": ")[1].removeprefix("test ") for key in single]
    means = [f"{len(pairs)} pairs, mean"] if pairs else []
    lines: list[list[str]] = []
    for row, words in named_rows(results, keys).items():
        found = next((results[key][row] for key in keys if row in results[key]), {})
        if row == REPEATS and not found:
            continue  # nothing was recorded twice
        cost = (
            [str(found["numbers"]), f"{found['seconds']:.0f} s"] if "seconds" in found else [""] * 2
        )
        left = [error(results, [key], row) for key in single]
        left += [error(results, pairs, row)] if pairs else []
        lines.append([words, *left, *cost])
    text = table(("left out", *splits, *means, "numbers", "time"), lines)
    if (fits := distinct_fits(results, keys)) == len(keys):
        return text
    return (
        f"{text}\n\nThe {len(keys)} splits are {fits} different fits: the others train "
        "on the same logs, and test on others."
    )


def distinct_fits(results: Results, keys: Sequence[str]) -> int:
    """Return how many different sets of training logs some splits have.

    The error of the data sheet, which nothing is fitted to, is that of the logs alone.
    """
    told = [results[key].get("data sheet", {}).get("trained") for key in keys]
    return len({key if left is None else left for key, left in zip(keys, told, strict=True)})


def named_rows(results: Results, keys: Sequence[str]) -> dict[str, str]:
    """Return the rows of some splits with their words."""
    plain = {row: row for key in keys for row in results[key] if row not in (*ROWS, OURS)}
    return {**ROWS, **plain, OURS: OURS}


@dataclass(frozen=True, kw_only=True)
class Beside:
    """What a diagnosis leaves of a split, beside the rival that turned out best there."""

    split: str
    ours: Mapping[str, Any]
    rival: str
    left: float  # Held-out error of that rival [mrad]

    @property
    def ratio(self) -> float:
        """Our error over the rival's [1]."""
        return self.ours["held_out"] / self.left


def beside_rivals(results: Results, rivals: Collection[str] = ()) -> list[Beside]:
    """Return each split that has a diagnosis and rivals, the worst ratio first.

    Args:
        results: Rows of each split.
        rivals: Rows that are rivals; without any all are but the repeats.
    """
    found: list[Beside] = []
    for split, rows in results.items():
        asked = rivals or rows.keys() - {REPEATS, OURS}
        left = {row: cells["held_out"] for row, cells in rows.items() if row in asked}
        if OURS in rows and left:
            best = min(left, key=left.__getitem__)
            found.append(Beside(split=split, ours=rows[OURS], rival=best, left=left[best]))
    return sorted(found, key=lambda each: -each.ratio)


def ratios(results: Results) -> str:
    """Return a table of the splits that a rival won, by our error over the best rival's."""
    found = beside_rivals(results)
    if not found:
        return "No split has a diagnosis beside rivals yet."
    heads = ("split", "diagnosed [mrad]", "best rival", "its error", "ratio", "named", "commit")
    lines = [
        [
            each.split, f"{each.ours['held_out']:.1f}", each.rival, f"{each.left:.1f}",
            f"{each.ratio:.2f}", str(each.ours["says"]), f"`{each.ours['commit'][:7]}`",
        ]
        for each in found
        if round(each.ratio, 2) > LEVEL
    ]  # fmt: skip
    every = [each.ratio for each in found]
    return (
        f"{table(heads, lines)}\n\n{len(every)} splits; ratio: median {median(every):.2f}, "
        f"greatest {max(every):.2f}; {sum(ratio <= LEVEL for ratio in every)} at {LEVEL} or less."
    )


def shares_of_arm(results: Results) -> str:
    """Return what each model leaves of the squared error of a servo that is where it is told."""
    pairs = [rows for split, rows in results.items() if split.startswith(ARM) and OURS in rows]
    lines: list[list[str]] = []
    told = [rows[TOLD]["held_out"] ** 2 for rows in pairs]
    seen: list[list[float]] = []
    for row in (OURS, *(name for name in pairs[0] if name not in (OURS, TOLD))):
        left = [rows[row]["held_out"] ** 2 for rows in pairs]
        if left in seen:
            continue  # a servo that follows by definition takes no notice of friction
        seen.append(left)
        alike = mean(one / whole for one, whole in zip(left, told, strict=True))
        name = "four numbers, nothing stated" if row == "four numbers" else row
        lines.append([name, f"{sum(left) / sum(told):.3f}", f"{alike:.3f}"])
    text = table(("squared error that is left", "pooled", "each pair alike"), lines)
    return f"{text}\n\n{len(pairs)} pairs; models without effect are left out."


def error(results: Results, keys: Sequence[str], row: str) -> str:
    """Return the mean held-out error of some splits; in brackets where a search has not ended."""
    made = [results[key][row]["held_out"] for key in keys if row in results[key]]
    if len(made) < len(keys):
        return "waits"
    text = f"{mean(made):.1f}"
    return f"({text})" if any(is_unfinished(results[key], row) for key in keys) else text


def is_unfinished(rows: Mapping[str, Mapping[str, Any]], row: str) -> bool:
    """Tell whether a row's search was stopped, or fits worse than a model that it contains."""
    from lab.studies.comparison.bam import CONTAINS, ROUNDING  # it reads logs, which needs tables

    if not row.startswith("bam "):
        return False
    contained = [f"bam {model}" for model in CONTAINS[row.removeprefix("bam ")]]
    least = min((rows[each]["trained"] for each in contained if each in rows), default=np.inf)
    return "not converged" in rows[row]["says"] or rows[row]["trained"] > least + ROUNDING
