"""Read from a ``diagnosis.json`` what it says of every cause that was tried."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import is_list, is_table
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import (
    ANSWER,
    StatedDiagnosis,
    diagnosis_table,
    state_diagnosis,
)
from tendon_newton.diagnosis.explanation import Estimate
from tendon_newton.diagnosis.result import Criterion


@dataclass(frozen=True, kw_only=True)
class Account:
    """What a diagnosis says of one cause that it tried."""

    name: str
    share: float  # Share of the squared error above the noise that it explains alone [1]
    values: Mapping[str, float]  # Numbers of that fit
    answer: Mapping[str, Estimate]  # Its numbers in the answer, beside the other causes
    named: bool
    rival_of: tuple[str, ...]  # Named causes from which the data cannot tell it
    rivals: tuple[str, ...]  # Causes from which the data cannot tell it, where it is named
    experiment: str | None  # What to record to tell them apart
    at_bound: tuple[str, ...]  # Numbers that ended at the edge of their ranges
    criteria: tuple[Criterion, ...]  # What it had to pass, in order
    acts_in: tuple[str, ...] | None
    """Recordings in which it changes more than is left over anyway; None where unknown."""
    looked_at: int  # Recordings in which that was looked at
    scale: BenchScale  # Size of the benches: on a shaft forces are torques

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
    has_force: bool  # Whether any recording has a force
    servos: int  # Servos of every recording
    scale: BenchScale  # Size of the benches

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
    return state_accounts(diagnosis_table(path / ANSWER if path.is_dir() else path))


def state_accounts(table: CheckedTable) -> Accounts:
    """Check the contents of a ``diagnosis.json``."""
    stated = state_diagnosis(table)
    scale = table.values.get("scale")
    on = BenchScale(is_shaft=is_table(scale) and scale.get("is_shaft") is True)
    causes = [state_account(row, stated, on) for row in table.tables("candidates")]
    order = [effect.name for effect in stated.effects]
    causes.sort(key=lambda c: (order.index(c.name) if c.named else len(order), -c.share))
    baseline = table.values.get("baseline")
    force = baseline.get("force_rmse") if is_table(baseline) else None
    servos = int(finite_number(table.values.get("servos")) or 1)
    return Accounts(
        stated=stated, causes=tuple(causes), has_force=force is not None, servos=servos, scale=on
    )


def state_account(row: CheckedTable, stated: StatedDiagnosis, scale: BenchScale) -> Account:
    """Check one entry of ``candidates``."""
    name = row.word("name")
    own = next((effect for effect in stated.effects if effect.name == name), None)
    said = own or next((effect for effect in stated.suspected if effect.name == name), None)
    values: Mapping[str, Any] = row.table("parameters").values if "parameters" in row else {}
    acts = row.values.get("acts_in")
    return Account(
        name=name,
        share=row.number("score"),
        values={k: number for k, v in values.items() if (number := finite_number(v)) is not None},
        answer={} if said is None else said.parameters,
        named=own is not None,
        rival_of=tuple(e.name for e in stated.effects if name in e.indistinguishable_from),
        rivals=() if own is None else own.indistinguishable_from,
        experiment=None if own is None else own.separating_experiment,
        at_bound=words(row.values.get("at_bound")) or (),
        criteria=row.value("criteria", tuple[Criterion, ...]) if "criteria" in row else (),
        acts_in=None if acts is None else words(acts),
        looked_at=int(finite_number(row.values.get("looked_at")) or 0),
        scale=scale,
    )


def words(value: Any) -> tuple[str, ...] | None:
    """Return a list of words; None where there is no such list."""
    if not is_list(value):
        return None
    return tuple(word for word in value if isinstance(word, str))
