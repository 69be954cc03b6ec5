"""Read a ``diagnosis.json``, ours or another program's, without trusting it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tendon_newton.data.files.checked_table import CheckedTable, read_checked
from tendon_newton.data.files.together import refuse_mix
from tendon_newton.diagnosis.result import SCHEMA, Errors, Estimate, Verdict
from tendon_newton.errors import InvalidDiagnosis

MODEL, ANSWER = "model.toml", "diagnosis.json"
"""Files of an answer."""
PROMISE = "a diagnosis is a JSON file"


@dataclass(frozen=True, kw_only=True)
class StatedCause:
    """A cause that a diagnosis names."""

    name: str
    side: str
    parameters: Mapping[str, Estimate]
    indistinguishable_from: tuple[str, ...]  # Effects that the data could not tell from it
    separating_experiment: str | None = None  # What to record to tell them apart


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
    start: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Effects of the model that was started from, and their numbers."""


def read_diagnosis(path: Path) -> StatedDiagnosis:
    """Read and check a ``diagnosis.json``.

    Raises:
        InvalidDiagnosis: The file is no diagnosis, or of another schema.
    """
    return state_diagnosis(diagnosis_table(path))


def diagnosis_table(path: Path) -> CheckedTable:
    """Read the object of a ``diagnosis.json``, beside which no other answer's files stand."""
    table = read_checked(path, InvalidDiagnosis, PROMISE)
    refuse_mix(path, table.values, InvalidDiagnosis)
    return table


def state_diagnosis(table: CheckedTable) -> StatedDiagnosis:
    """Check the contents of a ``diagnosis.json``; keys that a later release adds are left alone."""
    if table.values.get("schema") != SCHEMA:
        table.refuse("schema", f"{SCHEMA}, the one that this release reads")
    return table.record(StatedDiagnosis)
