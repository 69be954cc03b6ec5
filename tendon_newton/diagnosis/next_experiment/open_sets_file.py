"""Read from a diagnosis the sets of causes that it leaves open."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tendon_newton.data.bench_overrides import read_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.model_file import load_model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import (
    ANSWER,
    MODEL,
    StatedCause,
    StatedDiagnosis,
    diagnosis_table,
    state_diagnosis,
)
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, likeliest
from tendon_newton.diagnosis.posterior import Posterior, read_posterior
from tendon_newton.errors import InvalidDiagnosis, NothingToSeparate, TendonNewtonError, listed
from tendon_newton.identification.noise_floor import NoiseFloor

ALONE = 0.99
"""Weight beyond which a set is the only one that is left [1]: less than 0.1 bit is open then."""


def read_open_sets(folder: Path) -> tuple[OpenSets, tuple[Setting, ...]]:
    """Read the sets of causes that a diagnosis leaves open, and the benches that were recorded.

    Args:
        folder: Holds ``diagnosis.json``, the file of its sets beside it, and ``model.toml``.

    Raises:
        NothingToSeparate: One set is left, or none.
        InvalidDiagnosis: A file is broken.
    """
    path = folder / ANSWER
    table = diagnosis_table(path)
    stated, settings = state_diagnosis(table), read_recorded(table)
    question = OpenSets(
        posterior=likeliest(as_told(read_posterior(path), stated)),
        model=load_model(folder / MODEL),
        noise=table.value("noise_floor", NoiseFloor),
        scale=read_scale(table),
    )
    sets = question.posterior.sets
    if len(sets) < 2 or question.weights.max() > ALONE:
        raise NothingToSeparate(nothing_else(path, stated.effects))
    causes = {cause for own in sets for cause in own.causes}
    kept = tuple(effect for effect in question.model.effects if effect.cause not in causes)
    return replace(question, model=replace(question.model, effects=kept)), settings


def as_told(posterior: Posterior, stated: StatedDiagnosis) -> Posterior:
    """Return sets of which those of one class are equally likely, the likeliest first.

    A set with a cause in the place of one that the diagnosis cannot tell from it is as likely as
    the answer, as where the diagnosis itself proposes a run; causes without a name may be in both.
    """
    names, unnamed = (
        frozenset(e.name for e in causes) for causes in (stated.effects, stated.suspected)
    )
    alike = {names} | {
        names - {effect.name} | {rival}
        for effect in stated.effects
        for rival in effect.indistinguishable_from
    }
    most = max((own.weight for own in posterior.sets), default=0.0)
    told = (
        replace(own, weight=most)
        if len(alike) > 1 and frozenset(own.causes) - unnamed in alike
        else own
        for own in posterior.sets
    )
    return Posterior(sets=tuple(sorted(told, key=lambda own: -own.weight)))


def nothing_else(path: Path, effects: Sequence[StatedCause]) -> str:
    """Say that no other set can be asked about, and what the diagnosis proposes all the same."""
    for effect in effects:
        if effect.separating_experiment:
            return (
                f"no run is designed: {path} has no numbers of "
                f"{listed(effect.indistinguishable_from)}, which it cannot tell from "
                f"{effect.name}. It proposes: {effect.separating_experiment}"
            )
    return (
        f"no run is needed: {path}: an experiment separates sets of causes that a diagnosis leaves "
        f"open; it names {listed([e.name for e in effects])}, and leaves no other set open"
    )


def read_recorded(table: CheckedTable) -> tuple[Setting, ...]:
    """Return how the benches were set up, of which there must be some."""
    hint = "A diagnosis by this release lists them: diagnose the data again"
    rows = table.tables("recorded", hint=hint) or table.refuse(
        "recorded", "a list of objects", hint
    )
    return tuple(map(read_setting, rows))


def read_setting(row: CheckedTable) -> Setting:
    """Read how a bench was set up."""
    try:
        bench = read_bench_overrides(row.values.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDiagnosis(f"{row.where}: {error}") from error
    return row.record(Setting, bench_overrides=bench)


def read_scale(table: CheckedTable) -> BenchScale:
    """Read how large the benches are; without a word they are of the nominal size."""
    if "scale" not in table:
        return BenchScale()
    scale = table.value("scale", BenchScale)
    for key in ("force", "travel", "turn"):
        if getattr(scale, key) <= 0.0:
            table.table("scale").refuse(key, "> 0")
    return scale
