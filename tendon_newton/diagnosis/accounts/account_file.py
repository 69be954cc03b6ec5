"""Read from a ``diagnosis.json`` what it says of every cause that was tried."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import are_tables, is_list, is_table
from tendon_newton.diagnosis.diagnosis_file import (
    PROMISE,
    StatedDiagnosis,
    came,
    read_number,
    read_word,
    state_diagnosis,
)
from tendon_newton.diagnosis.result import Criterion
from tendon_newton.errors import InvalidDiagnosis

FILE = "diagnosis.json"


@dataclass(frozen=True, kw_only=True)
class Account:
    """What a diagnosis says of one cause that it tried."""

    name: str
    share: float
    """Share of the squared error above the noise that it explains alone [1]."""
    values: Mapping[str, float]
    """Numbers of that fit."""
    named: bool
    rival_of: tuple[str, ...]
    """Named causes from which the data cannot tell it."""
    rivals: tuple[str, ...]
    """Causes from which the data cannot tell it, where it is named."""
    experiment: str | None
    """What to record to tell them apart."""
    at_bound: tuple[str, ...]
    """Numbers that ended at the edge of their ranges."""
    criteria: tuple[Criterion, ...]
    """What it had to pass, in order."""
    probability: float | None
    """Share of draws of blocks of time in which it passes again [1]."""
    acts_in: tuple[str, ...] | None
    """Recordings in which it changes more than is left over anyway; None where unknown."""
    looked_at: int
    """Recordings in which that was looked at."""

    @property
    def failed(self) -> tuple[Criterion, ...]:
        """What it did not pass."""
        return tuple(criterion for criterion in self.criteria if not criterion.passed)


@dataclass(frozen=True, kw_only=True)
class Accounts:
    """What a diagnosis says of all causes."""

    stated: StatedDiagnosis
    causes: tuple[Account, ...]
    """Every cause that was tried, the named ones first, then by what each explains alone."""
    has_force: bool
    """Whether any recording has a force."""

    def find(self, name: str) -> Account | None:
        """Return the account of one cause; None where it was not tried."""
        return next((cause for cause in self.causes if cause.name == name), None)


def read_accounts(path: Path) -> Accounts:
    """Read all accounts.

    Args:
        path: ``diagnosis.json``, or the folder that holds it.

    Raises:
        InvalidDiagnosis: The file is no diagnosis, or says nothing of what was tried.
    """
    path = path / FILE if path.is_dir() else path
    return state_accounts(read_json(path, InvalidDiagnosis, PROMISE), str(path))


def state_accounts(table: Mapping[str, Any], where: str) -> Accounts:
    """Check the contents of a ``diagnosis.json``.

    Args:
        table: The file's object.
        where: The file, for messages.
    """
    stated = state_diagnosis(table, where)
    rows = table.get("candidates")
    if not are_tables(rows):
        raise InvalidDiagnosis(
            f"{where}: candidates must be a list of objects; it is {came(table, 'candidates')}"
        )
    causes = [state_account(row, stated, f"{where}: candidates[{i}]") for i, row in enumerate(rows)]
    order = [effect.name for effect in stated.effects]
    causes.sort(key=lambda c: (order.index(c.name) if c.named else len(order), -c.share))
    baseline = table.get("baseline")
    force = baseline.get("force_rmse") if is_table(baseline) else None
    return Accounts(stated=stated, causes=tuple(causes), has_force=force is not None)


def state_account(row: Mapping[str, Any], stated: StatedDiagnosis, where: str) -> Account:
    """Check one entry of ``candidates``."""
    name = read_word(row, "name", where)
    own = next((effect for effect in stated.effects if effect.name == name), None)
    values = row.get("parameters", {})
    if not is_table(values):
        raise InvalidDiagnosis(f"{where}: parameters must be an object; it is {values!r:.60}")
    numbers = {key: finite_number(value) for key, value in values.items()}
    acts = row.get("acts_in")
    return Account(
        name=name,
        share=read_number(row, "score", where),
        values={key: value for key, value in numbers.items() if value is not None},
        named=own is not None,
        rival_of=tuple(e.name for e in stated.effects if name in e.indistinguishable_from),
        rivals=() if own is None else own.indistinguishable_from,
        experiment=None if own is None else own.separating_experiment,
        at_bound=words(row.get("at_bound")) or (),
        criteria=state_criteria(row, where),
        probability=finite_number(row.get("probability")),
        acts_in=None if acts is None else words(acts),
        looked_at=int(finite_number(row.get("looked_at")) or 0),
    )


def words(value: Any) -> tuple[str, ...] | None:
    """Return a list of words; None where there is no such list."""
    if not is_list(value):
        return None
    return tuple(word for word in value if isinstance(word, str))


def state_criteria(row: Mapping[str, Any], where: str) -> tuple[Criterion, ...]:
    """Check what a cause had to pass."""
    criteria = row.get("criteria", [])
    if not are_tables(criteria):
        raise InvalidDiagnosis(
            f"{where}: criteria must be a list of objects; it is {came(row, 'criteria')}"
        )
    return tuple(
        Criterion(
            name=read_word(criterion, "name", where),
            value=read_number(criterion, "value", where),
            bar=read_number(criterion, "bar", where),
            passed=criterion.get("passed") is True,
        )
        for criterion in criteria
    )
