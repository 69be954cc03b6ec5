"""Read from a diagnosis the causes that it could not tell apart."""

from pathlib import Path

from tendon_newton.data.bench_overrides import read_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.model_file import load_model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import (
    StatedCause,
    diagnosis_table,
    state_diagnosis,
    state_estimates,
)
from tendon_newton.diagnosis.explanation import (
    Explanation,
    OpenClass,
    Setting,
    model_without,
)
from tendon_newton.diagnosis.next_experiment.separation import NO_RUN
from tendon_newton.errors import (
    InvalidDiagnosis,
    NothingToSeparate,
    TendonNewtonError,
    listed,
)
from tendon_newton.identification.noise_floor import NoiseFloor

FILE = "diagnosis.json"


def read_open_class(folder: Path, cause: str | None = None) -> OpenClass:
    """Read a class of causes that a diagnosis could not tell apart.

    Args:
        folder: Holds ``diagnosis.json`` and ``model.toml``.
        cause: The named cause, of several; by default the first whose class a run separates, else
            the first that stands for one.

    Raises:
        NothingToSeparate: There is no such class.
        InvalidDiagnosis: The cause stands for none, or a file is broken.
    """
    path = folder / FILE
    table = diagnosis_table(path)
    stated = state_diagnosis(table)
    classes = [effect.name for effect in stated.effects if effect.indistinguishable_from]
    if not classes:
        raise NothingToSeparate(
            f"{path}: an experiment separates causes that a diagnosis could not tell apart; it "
            f"names {listed([e.name for e in stated.effects])}, and leaves none of them open"
        )
    separable = [e.name for e in stated.effects if e.name in classes and run_separates(e)]
    chosen = cause or (separable or classes)[0]
    if chosen not in classes:
        raise InvalidDiagnosis(
            f"{path}: {chosen!r} must be a named cause that was not told from others; "
            f"those are {listed(classes)}"
        )
    effect = next(row for row in table.tables("effects") if row.word("name") == chosen)
    return OpenClass(
        explanations=tuple(map(read_explanation, read_rows(effect, "explanations"))),
        without=model_without(load_model(folder / "model.toml"), chosen),
        settings=tuple(map(read_setting, read_rows(table, "recorded"))),
        noise=read_noise(table),
        scale=read_scale(table),
    )


def run_separates(cause: StatedCause) -> bool:
    """Tell whether a run of the library tells a cause from those that look like it."""
    proposal = cause.separating_experiment
    return proposal is not None and not proposal.startswith(NO_RUN)


def read_rows(table: CheckedTable, key: str) -> list[CheckedTable]:
    """Return the objects under a key, of which there must be some."""
    hint = "A diagnosis by this release lists them: diagnose the data again"
    return table.tables(key, hint=hint) or table.refuse(key, "a list of objects", hint)


def read_explanation(row: CheckedTable) -> Explanation:
    """Read one way to explain the data."""
    numbers = row.table("numbers")
    return Explanation(
        cause=row.word("cause"),
        numbers={owner: state_estimates(numbers.table(owner)) for owner in numbers.values},
    )


def read_setting(row: CheckedTable) -> Setting:
    """Read how a bench was set up."""
    try:
        bench = read_bench_overrides(row.values.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDiagnosis(f"{row.where}: {error}") from error
    return Setting(
        bench=row.word("bench"),
        seconds=row.number("seconds"),
        bench_overrides=bench,
        actuator_overrides=row.numbers("actuator_overrides") if "actuator_overrides" in row else {},
    )


def read_scale(table: CheckedTable) -> BenchScale:
    """Read how large the benches are; without a word they are of the nominal size."""
    if "scale" not in table:
        return BenchScale()
    own = table.table("scale")
    numbers = {key: own.number(key) for key in ("force", "travel", "turn") if key in own}
    for key, value in numbers.items():
        if value <= 0.0:
            own.refuse(key, "> 0")
    return BenchScale(**numbers, is_shaft=own.values.get("is_shaft") is True)


def read_noise(table: CheckedTable) -> NoiseFloor:
    """Read the noise of the sensors."""
    floor = table.table("noise_floor")
    has_force = floor.values.get("force") is not None
    return NoiseFloor(
        theta=floor.number("theta"), force=floor.number("force") if has_force else None
    )
