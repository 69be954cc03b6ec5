"""Tables of the comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

REPEATS, OURS, ARM = "repeats", "ours, diagnosed", "so101"
ROWS = {
    REPEATS: "repeats of the same motion: no model can do better",
    "data sheet": "data sheet, nothing fitted",
    "four numbers": "lag, delay, deadband and offset, no physics",
    **{f"bam {m}": f"Rhoban/bam {m}, refitted by its own program" for m in
       ("m1", "m2", "m3", "m4", "m5", "m6")},
}  # fmt: skip
"""Rows, in order, with their words; then come plain models of ours, by their names."""

Results = Mapping[str, Mapping[str, Mapping[str, Any]]]


def tables(results: Results) -> str:
    """Return one table of errors and one of costs for each servo that stands alone."""
    servos = [s for s in dict.fromkeys(key.split(":")[0] for key in results) if s != ARM]
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
    for row, words in named_rows(results, keys).items():
        if row == REPEATS and not any(row in results[key] for key in keys):
            continue  # nothing was recorded twice
        lines.append([words, *(error(results[key].get(row)) for key in keys)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def named_rows(results: Results, keys: Sequence[str]) -> dict[str, str]:
    """Return the rows of some splits with their words."""
    plain = {row: row for key in keys for row in results[key] if row not in (*ROWS, OURS)}
    return {**ROWS, **plain, OURS: OURS}


def beside_rivals(results: Results) -> str:
    """Return what a diagnosis leaves of each split beside the best of all others."""
    head = ["split", "diagnosed", "best rival", "it leaves", "ratio", "names", "time"]
    lines, ratios = [head, ["---"] * len(head)], []
    for key, rows in results.items():
        rivals = {
            row: cells["held_out"] for row, cells in rows.items() if row not in (REPEATS, OURS)
        }
        if OURS not in rows or not rivals:
            continue
        ours, best = rows[OURS], min(rivals, key=rivals.__getitem__)
        ratios.append(ours["held_out"] / rivals[best])
        lines.append(
            [
                key, f"{ours['held_out']:.1f}", best, f"{rivals[best]:.1f}", f"{ratios[-1]:.2f}",
                str(ours["says"]), f"{ours['seconds']:.0f} s",
            ]
        )  # fmt: skip
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    if not ratios:
        return text
    return f"{text}\n\nratio: median {median(ratios):.2f}, greatest {max(ratios):.2f}"


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
    words = named_rows(results, keys)
    found = {
        row: next((results[key][row] for key in keys if row in results[key]), {}) for row in words
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
        [words[row], str(cells["numbers"]), f"{cells['seconds']:.0f} s", str(cells["says"])]
        for row, cells in timed.items()
        if not row.startswith("bam")
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def span(values: Sequence[float]) -> str:
    """Return the least and the greatest of some values."""
    return f"{min(values):.0f} to {max(values):.0f}"
