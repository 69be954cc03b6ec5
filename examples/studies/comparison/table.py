"""Tables of the comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

REPEATS = "repeats"
ROWS = {
    REPEATS: "repeats of the same motion: no model can do better",
    "data sheet": "data sheet, nothing fitted",
    "four numbers": "lag, delay, deadband and offset, no physics",
    **{f"bam {m}": f"Rhoban/bam {m}, refitted by its own program" for m in
       ("m1", "m2", "m3", "m4", "m5", "m6")},
    "ours, two effects": "ours, two effects, the pair of a list that fits the training logs best",
    "ours, diagnosed": "ours, diagnosed",
}  # fmt: skip
"""Rows, in order, with their words."""

Results = Mapping[str, Mapping[str, Mapping[str, Any]]]


def tables(results: Results) -> str:
    """Return one table of errors and one of costs."""
    servos = list(dict.fromkeys(key.split(":")[0] for key in results))
    return "\n\n".join(
        part
        for servo in servos
        for keys in [[key for key in results if key.startswith(f"{servo}:")]]
        for part in (f"### {servo.upper()}", errors(results, keys), costs(results, keys))
    )


def errors(results: Results, keys: Sequence[str]) -> str:
    """Return held-out errors, with those on the training logs in brackets [mrad]."""
    head = ["held out (trained) [mrad]", *(key.split(": ")[1] for key in keys)]
    lines = [head, ["---"] * len(head)]
    for row, words in ROWS.items():
        if row == REPEATS and not any(row in results[key] for key in keys):
            continue  # nothing was recorded twice
        lines.append([words, *(error(results[key].get(row)) for key in keys)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def error(found: Mapping[str, Any] | None) -> str:
    """Return one error in words; a row that waits has a dash."""
    if found is None:
        return "waits"
    if "trained" not in found:
        return f"{found['held_out']:.1f}"
    return f"{found['held_out']:.1f} ({found['trained']:.1f})"


def costs(results: Results, keys: Sequence[str]) -> str:
    """Return numbers, time and what each says, of the first split that has the row."""
    lines = [["", "numbers", "time of a fit", "says"], ["---"] * 4]
    found = {
        row: next((results[key][row] for key in keys if row in results[key]), {}) for row in ROWS
    }
    timed = {row: cells for row, cells in found.items() if "seconds" in cells}
    theirs = [cells for row, cells in timed.items() if row.startswith("bam")]
    if theirs:
        lines.append(
            [
                "Rhoban/bam, each of its models",
                span([cells["numbers"] for cells in theirs]),
                f"{span([cells['seconds'] for cells in theirs])} s",
                str(theirs[0]["says"]),
            ]
        )
    lines += [
        [ROWS[row], str(cells["numbers"]), f"{cells['seconds']:.0f} s", str(cells["says"])]
        for row, cells in timed.items()
        if not row.startswith("bam")
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def span(values: Sequence[float]) -> str:
    """Return the least and the greatest of some values."""
    return f"{min(values):.0f} to {max(values):.0f}"
