"""Read what is hidden in one dataset of an exam, ``truth/NAME.json``."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from tendon_lab.exam.exam_score import Family, Truth
from tendon_newton.data.files.checked_table import read_checked
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import is_table
from tendon_newton.errors import InvalidDataset, listed

PROMISE = "a truth is a JSON file"


def read_truth(path: Path) -> Truth:
    """Read the truth of one dataset; keys that only its maker uses are left alone.

    Raises:
        InvalidDataset: The file is no truth.
    """
    table = read_checked(path, InvalidDataset, PROMISE)
    family: Any = table.values.get("family")
    if table.values.get("id") != path.stem:
        table.refuse("id", f"the file's own name, {path.stem!r}")
    if family not in get_args(Family):
        table.refuse("family", f"one of {listed(get_args(Family))}")
    outside = table.tables("outside") if "outside" in table else []
    return Truth(
        id=path.stem,
        family=family,
        effects={row.word("name"): row.numbers("parameters") for row in table.tables("effects")},
        outside=tuple(cause.word("name") for cause in outside),
        near=tuple(name for cause in outside if "near" in cause for name in cause.words("near")),
        weak=table.values.get("weak") is True,
        oracle=read_oracle(table.values),
    )


def read_oracle(table: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return each signal's held-out error with the starting and the true model, where told."""
    oracle = table.get("oracle")
    models = oracle if is_table(oracle) else {}
    start, true = (row if is_table(row := models.get(key)) else {} for key in ("nominal", "true"))
    pairs = {
        key: (finite_number(value), finite_number(true.get(key))) for key, value in start.items()
    }
    return {key: (a, b) for key, (a, b) in pairs.items() if a is not None and b is not None}
