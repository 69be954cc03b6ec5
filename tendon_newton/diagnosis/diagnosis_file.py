"""Read a ``diagnosis.json``, ours or another program's, without trusting it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from tendon_newton.data.files.checked_table import CheckedTable, read_checked
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import is_list, is_table
from tendon_newton.diagnosis.result import SCHEMA, Errors, Estimate, Verdict
from tendon_newton.errors import InvalidDiagnosis, listed, shown

PROMISE = "a diagnosis is a JSON file"


@dataclass(frozen=True, kw_only=True)
class StatedCause:
    """A cause that a diagnosis names."""

    name: str
    side: str
    parameters: Mapping[str, Estimate]
    indistinguishable_from: tuple[str, ...]  # Effects that the data could not tell from it
    separating_experiment: str | None  # What to record to tell them apart


@dataclass(frozen=True, kw_only=True)
class StatedDiagnosis:
    """What a ``diagnosis.json`` says, as far as a program that reads it relies on it."""

    verdict: Verdict
    wall_time_s: float
    effects: tuple[StatedCause, ...]  # Causes, strongest first
    suspected: tuple[StatedCause, ...] = ()  # Causes that deserve no name
    fitted: Mapping[str, Estimate] = field(default_factory=dict)
    """Numbers of the actuator that were refitted, by name."""
    extended: Errors | None = None  # Held-out errors of the extended model


def read_diagnosis(path: Path) -> StatedDiagnosis:
    """Read and check a ``diagnosis.json``.

    Raises:
        InvalidDiagnosis: The file is no diagnosis, or of another schema.
    """
    return state_diagnosis(diagnosis_table(path))


def diagnosis_table(path: Path) -> CheckedTable:
    """Read the object of a ``diagnosis.json``."""
    return read_checked(path, InvalidDiagnosis, PROMISE)


def state_diagnosis(table: CheckedTable) -> StatedDiagnosis:
    """Check the contents of a ``diagnosis.json``; keys that a later release adds are left alone."""
    if table.values.get("schema") != SCHEMA:
        table.refuse("schema", f"{SCHEMA}, the one that this release reads")
    verdict: Any = table.values.get("verdict")
    if verdict not in get_args(Verdict):
        table.refuse("verdict", f"one of {listed(get_args(Verdict))}")
    return StatedDiagnosis(
        verdict=verdict,
        wall_time_s=table.number("wall_time_s"),
        effects=tuple(state_cause(effect) for effect in table.tables("effects")),
        suspected=tuple(state_cause(effect) for effect in table.tables("suspected"))
        if "suspected" in table
        else (),
        fitted=state_estimates(table.table("fitted")) if "fitted" in table else {},
        extended=state_errors(table.table("extended")) if "extended" in table else None,
    )


def state_errors(table: CheckedTable) -> Errors:
    """Check held-out errors."""
    has_cell = table.values.get("force_rmse") is not None
    return Errors(
        force_rmse=table.number("force_rmse") if has_cell else None,
        theta_rmse=table.number("theta_rmse"),
        theta_mae=table.number("theta_mae"),
    )


def state_cause(table: CheckedTable) -> StatedCause:
    """Check one entry of ``effects``."""
    experiment = table.values.get("separating_experiment")
    return StatedCause(
        name=table.word("name"),
        side=table.word("side"),
        parameters=state_estimates(table.table("parameters")),
        indistinguishable_from=table.words("indistinguishable_from"),
        separating_experiment=experiment if isinstance(experiment, str) else None,
    )


def state_estimates(table: CheckedTable) -> dict[str, Estimate]:
    """Check fitted numbers by name."""
    return {
        name: state_estimate(row, f"{table.where}: parameter {shown(name)}")
        for name, row in table.values.items()
    }


def state_estimate(row: Any, where: str) -> Estimate:
    """Check one fitted number."""
    if not is_table(row):
        raise InvalidDiagnosis(
            f"{where} must be an object with value, ci95 and unit; it is {shown(row)}"
        )
    table = CheckedTable(row, where, InvalidDiagnosis)
    ends = row.get("ci95")
    interval = [finite_number(end) for end in ends] if is_list(ends) else []
    if len(interval) != 2 or interval[0] is None or interval[1] is None:
        table.refuse("ci95", "two numbers")
    return Estimate(
        value=table.number("value"),
        ci95=(interval[0], interval[1]),
        unit=table.word("unit"),
        at_bound=row.get("at_bound") is True,
        flat=row.get("flat") is True,
        null=finite_number(row.get("null")),
    )
