"""Mends of columns that make no recording as they stand: signs that were lost, and stamps."""

from collections.abc import Iterator, Mapping

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.recording import Array, Indices
from tendon_newton.data.stamps import increasing_parts, stamp_fault

LEAST_TIME = 1.0  # [s] a part of a log that is shorter tells nothing

Columns = dict[str, Array]


def mended_columns(columns: Columns, name: str) -> tuple[list[Columns], list[Finding]]:
    """Give columns their signs back, and cut them where their clock begins again.

    Args:
        columns: Columns in our units by name, shape (T,) each.
        name: The recording, for the findings.

    Returns:
        The columns of each part, and what was mended; the columns as they were where nobody can.
    """
    found: list[Finding] = []
    for column, values in columns.items():
        lost = lost_sign(values) if column != "t" and np.isfinite(values).all() else None
        if lost is not None:
            columns = {**columns, column: lost.mended(values)}
            found.append(
                Examined(name, column).note(f"{int(lost.rows.sum())} rows", f"mended: {lost.text}")
            )
    time = columns["t"]
    fault = stamp_fault(time) if np.isfinite(time).all() else None
    parts = [] if fault is None else increasing_parts(time)
    if fault is None or not parts:
        return [columns], found
    told = "mended: rows stand in the order of their stamps, each stamp once"
    found.append(Examined(name, "t").note(fault, told))
    return list(long_parts(columns, parts)), found


def names_of_parts(name: str, count: int) -> list[str]:
    """Return the names of a recording's parts: its own where there is one."""
    if count == 1:
        return [name]
    return [name.replace(".csv", f"_clock{k}.csv") for k in range(count)]


def long_parts(columns: Mapping[str, Array], parts: list[Indices]) -> Iterator[Columns]:
    """Give the columns of each part that is long enough; of the longest where none is."""
    lasting = [float(columns["t"][rows[-1]] - columns["t"][rows[0]]) for rows in parts]
    for rows, time in zip(parts, lasting, strict=True):
        if time >= LEAST_TIME or time == max(lasting):
            yield {column: values[rows] for column, values in columns.items()}
