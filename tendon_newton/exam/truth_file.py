"""Read what is hidden in one dataset of an exam, ``truth/NAME.json``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.errors import InvalidDataset, listed, shown
from tendon_newton.exam.exam_score import Family, Truth

PROMISE = "a truth is a JSON file"


def read_truth(path: Path) -> Truth:
    """Read the truth of one dataset; keys that only its maker uses are left alone.

    Raises:
        InvalidDataset: The file is no truth.
    """
    table = read_json(path, InvalidDataset, PROMISE)
    name = table.get("id")
    family: Any = table.get("family")
    if name != path.stem:
        raise InvalidDataset(
            f"{path}: id must be the file's own name, {path.stem!r}; it is {shown(name)}"
        )
    if family not in get_args(Family):
        raise InvalidDataset(
            f"{path}: family must be one of {listed(get_args(Family))}; it is {shown(family)}"
        )
    effects = rows(table, "effects", str(path))
    outside = rows(table, "outside", str(path)) if "outside" in table else []
    return Truth(
        id=path.stem,
        family=family,
        effects={effect["name"]: read_parameters(effect, str(path)) for effect in effects},
        outside=tuple(cause["name"] for cause in outside),
        near=tuple(name for cause in outside for name in read_names(cause, str(path))),
        strength=read_strength(table, str(path)),
        weak=table.get("weak") is True,
        oracle=read_oracle(table),
    )


def rows(table: Mapping[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """Return the causes under a key, each an object with a name."""
    found = table.get(key)
    if not isinstance(found, list) or not all(
        isinstance(row, dict) and isinstance(row.get("name"), str) for row in found
    ):
        raise InvalidDataset(
            f"{where}: {key} must be a list of objects with a name; it is {shown(found)}"
        )
    return found


def read_parameters(effect: Mapping[str, Any], where: str) -> dict[str, float]:
    """Return the true numbers of an effect."""
    found = effect.get("parameters")
    numbers = (
        {key: finite_number(value) for key, value in found.items()}
        if isinstance(found, dict)
        else {"parameters": None}
    )
    known = {key: number for key, number in numbers.items() if number is not None}
    if len(known) < len(numbers):
        raise InvalidDataset(
            f"{where}: parameters of {shown(effect['name'])} must be an object of finite numbers; "
            f"it is {shown(found)}"
        )
    return known


def read_names(cause: Mapping[str, Any], where: str) -> list[str]:
    """Return the effects that imitate a cause outside the catalogue."""
    near = cause.get("near", [])
    if not isinstance(near, list) or not all(isinstance(name, str) for name in near):
        raise InvalidDataset(
            f"{where}: near of {shown(cause['name'])} must be a list of names; it is {shown(near)}"
        )
    return near


def read_strength(table: Mapping[str, Any], where: str) -> float:
    """Return the change of the held-out force [noise floors]; 0 where the truth does not say."""
    strength = table.get("strength", {})
    ratio = strength.get("ratio", 0.0) if isinstance(strength, dict) else None
    number = finite_number(ratio)
    if number is None:
        raise InvalidDataset(
            f"{where}: strength must be an object with a number ratio; it is {shown(strength)}"
        )
    return number


def read_oracle(table: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return each signal's held-out error with the starting and the true model, where told."""
    oracle = table.get("oracle")
    models = oracle if isinstance(oracle, dict) else {}
    start, true = (
        row if isinstance(row := models.get(key), dict) else {} for key in ("nominal", "true")
    )
    pairs = {
        key: (finite_number(value), finite_number(true.get(key))) for key, value in start.items()
    }
    return {key: (a, b) for key, (a, b) in pairs.items() if a is not None and b is not None}
