"""A diagnosis as it was written, to be asked again in Python."""

from math import inf, nan
from pathlib import Path

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.model_file import load_model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import ANSWER, MODEL, diagnosis_table, state_diagnosis
from tendon_newton.diagnosis.identifiability import Confounded
from tendon_newton.diagnosis.next_experiment.open_sets_file import read_scale, read_setting
from tendon_newton.diagnosis.posterior import read_posterior
from tendon_newton.diagnosis.result import (
    ActuatorFound,
    CandidateScore,
    Diagnosis,
    Errors,
    NamedEffect,
    Rival,
    Unexplained,
)
from tendon_newton.diagnosis.unexplained.remainder_structure import RemainderStructure


def load_diagnosis(path: str | Path) -> Diagnosis:
    """Read what the verb diagnose wrote.

    The profiles of what remains are in the report alone, and are empty.

    Args:
        path: Folder of the answer, or its ``diagnosis.json``; ``model.toml`` and the file of what
            is left open lie beside it.

    Raises:
        InvalidDiagnosis: A file is missing or broken, or of another release.
        InvalidModelFile: The model is.
    """
    path = Path(path)
    file = path / ANSWER if path.is_dir() else path
    table = diagnosis_table(file)
    state_diagnosis(table)
    noise, scale = table.table("noise_floor"), read_scale(table)
    pairs = table.table("identifiability").tables("confounded")
    return table.record(
        Diagnosis,
        noise_force=noise.value("force", float | None),
        noise_theta=noise.number("theta"),
        noise_others={s: noise.number(s) for s in noise.values if s not in ("theta", "force")},
        explained_interval=table.pair("explained_fraction_ci95"),
        effects=tuple(map(named, table.tables("effects"))),
        suspected=tuple(map(named, table.tables("suspected"))),
        candidates=tuple(map(tried, table.tables("candidates"))),
        rivals=tuple(
            row.record(Rival, errors=row.record(Errors), held_out=row.number("held_out_score"))
            for row in table.tables("rivals")
        ),
        unexplained=left(table.table("unexplained"), scale),
        model=load_model(file.with_name(MODEL)),
        actuator=actuator(table.table("actuator")) if "actuator" in table else None,
        posterior=read_posterior(file),
        confounded=tuple(pair(row) for row in pairs),
        scale=scale,
        recorded=tuple(map(read_setting, table.tables("recorded"))),
    )


def without(gain: CheckedTable) -> Errors:
    """Read the held-out errors of a model without something; mean absolute ones are not kept."""
    force = gain.pair("force_rmse")[0] if "force_rmse" in gain else None
    others = {name.removesuffix("_rmse"): gain.pair(name)[0] for name in gain.values
              if name not in ("force_rmse", "theta_rmse")}  # fmt: skip
    return Errors(theta_rmse=gain.pair("theta_rmse")[0], theta_mae=nan, force_rmse=force,
                  others_rmse=others)  # fmt: skip


def named(row: CheckedTable) -> NamedEffect:
    """Read a cause."""
    return row.record(NamedEffect, without=without(row.table("gain")))


def actuator(row: CheckedTable) -> ActuatorFound:
    """Read what was wrong with the actuator."""
    return row.record(ActuatorFound, without=without(row.table("gain")))


def tried(row: CheckedTable) -> CandidateScore:
    """Read how one effect did alone; an infinite number and the bounds are not in the file."""
    values = row.numbers("parameters")
    at_bound = row.words("at_bound") if "at_bound" in row else ()
    return row.record(
        CandidateScore,
        values=values,
        at_bound={name: values.get(name, inf) for name in at_bound},
        acts_in=row.words("acts_in") if "acts_in" in row else None,
    )


def left(row: CheckedTable, scale: BenchScale) -> Unexplained:
    """Read what remains."""
    if "structure" not in row:
        return row.record(Unexplained)
    structure = row.table("structure").record(RemainderStructure, scale=scale)
    return row.record(Unexplained, structure=structure)


def pair(row: CheckedTable) -> Confounded:
    """Read two numbers that are known together."""
    numbers = row.words("numbers")
    if len(numbers) != 2:
        row.refuse("numbers", "two names")
    return row.record(Confounded, first=numbers[0], second=numbers[1])
