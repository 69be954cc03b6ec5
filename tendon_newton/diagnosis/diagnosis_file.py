"""Read a ``diagnosis.json``, ours or another program's, without trusting it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.diagnosis.result import SCHEMA, Estimate, Verdict
from tendon_newton.errors import InvalidDiagnosis, listed, shown

PROMISE = "a diagnosis is a JSON file"


@dataclass(frozen=True, kw_only=True)
class StatedCause:
    """A cause that a diagnosis names."""

    name: str
    side: str
    parameters: Mapping[str, Estimate]
    indistinguishable_from: tuple[str, ...]
    """Effects that the data could not tell from it."""
    separating_experiment: str | None
    """What to record to tell them apart."""


@dataclass(frozen=True, kw_only=True)
class StatedDiagnosis:
    """What a ``diagnosis.json`` says, as far as a program that reads it relies on it."""

    verdict: Verdict
    wall_time_s: float
    effects: tuple[StatedCause, ...]
    """Causes, strongest first."""


def read_diagnosis(path: Path) -> StatedDiagnosis:
    """Read and check a ``diagnosis.json``.

    Raises:
        InvalidDiagnosis: The file is no diagnosis, or of another schema.
    """
    return state_diagnosis(read_json(path, InvalidDiagnosis, PROMISE), str(path))


def state_diagnosis(table: Mapping[str, Any], where: str) -> StatedDiagnosis:
    """Check the contents of a ``diagnosis.json``; keys that a later release adds are left alone.

    Args:
        table: The file's object.
        where: The file, for messages.
    """
    if table.get("schema") != SCHEMA:
        raise InvalidDiagnosis(
            f"{where}: schema must be {SCHEMA}, the one that this release reads; "
            f"it is {came(table, 'schema')}"
        )
    verdict: Any = table.get("verdict")
    if verdict not in get_args(Verdict):
        raise InvalidDiagnosis(
            f"{where}: verdict must be one of {listed(get_args(Verdict))}; "
            f"it is {came(table, 'verdict')}"
        )
    effects = table.get("effects")
    if not isinstance(effects, list) or not all(isinstance(effect, dict) for effect in effects):
        raise InvalidDiagnosis(
            f"{where}: effects must be a list of objects; it is {came(table, 'effects')}"
        )
    return StatedDiagnosis(
        verdict=verdict,
        wall_time_s=read_number(table, "wall_time_s", where),
        effects=tuple(
            state_cause(effect, f"{where}: effects[{index}]")
            for index, effect in enumerate(effects)
        ),
    )


def state_cause(table: Mapping[str, Any], where: str) -> StatedCause:
    """Check one entry of ``effects``."""
    parameters = table.get("parameters")
    if not isinstance(parameters, dict):
        raise InvalidDiagnosis(
            f"{where}: parameters must be an object; it is {came(table, 'parameters')}"
        )
    others = table.get("indistinguishable_from")
    if not isinstance(others, list) or not all(isinstance(name, str) for name in others):
        raise InvalidDiagnosis(
            f"{where}: indistinguishable_from must be a list of names; "
            f"it is {came(table, 'indistinguishable_from')}"
        )
    experiment = table.get("separating_experiment")
    return StatedCause(
        name=read_word(table, "name", where),
        side=read_word(table, "side", where),
        parameters={
            name: state_estimate(row, f"{where}: parameter {shown(name)}")
            for name, row in parameters.items()
        },
        indistinguishable_from=tuple(others),
        separating_experiment=experiment if isinstance(experiment, str) else None,
    )


def state_estimate(row: Any, where: str) -> Estimate:
    """Check one fitted number."""
    if not isinstance(row, dict):
        raise InvalidDiagnosis(
            f"{where} must be an object with value, ci95 and unit; it is {shown(row)}"
        )
    ends = row.get("ci95")
    interval = [finite_number(end) for end in ends] if isinstance(ends, list) else []
    if len(interval) != 2 or interval[0] is None or interval[1] is None:
        raise InvalidDiagnosis(f"{where}: ci95 must be two numbers; it is {came(row, 'ci95')}")
    return Estimate(
        value=read_number(row, "value", where),
        ci95=(interval[0], interval[1]),
        unit=read_word(row, "unit", where),
        at_bound=row.get("at_bound") is True,
    )


def read_number(table: Mapping[str, Any], key: str, where: str) -> float:
    """Return the finite number under a key."""
    number = finite_number(table.get(key))
    if number is None:
        raise InvalidDiagnosis(f"{where}: {key} must be a finite number; it is {came(table, key)}")
    return number


def read_word(table: Mapping[str, Any], key: str, where: str) -> str:
    """Return the text under a key."""
    if not isinstance(word := table.get(key), str):
        raise InvalidDiagnosis(f"{where}: {key} must be text; it is {came(table, key)}")
    return word


def came(table: Mapping[str, Any], key: str) -> str:
    """Say what stands under a key."""
    return shown(table[key]) if key in table else f"missing, there are {listed(table)}"
