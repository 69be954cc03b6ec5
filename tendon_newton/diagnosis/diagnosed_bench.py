"""Which bench a diagnosis is of: whoever uses its model takes that bench.

A diagnosis is named by its folder or its ``diagnosis.json``, and then holds for its own benches.
The ``model.toml`` alone is a servo for any bench; unless a bench is named it stays on its own.
"""

from collections.abc import Collection
from pathlib import Path

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.diagnosis.diagnosis_file import diagnosis_table
from tendon_newton.errors import InvalidParameter, listed

FILE, MODEL = "diagnosis.json", "model.toml"


def model_path(path: Path) -> Path:
    """Return the model file of a diagnosis, or the path itself."""
    if path.is_dir():
        return path / MODEL
    return path.with_name(MODEL) if path.suffix == ".json" else path


def recorded_benches(path: Path) -> tuple[str, ...]:
    """Return the benches that a diagnosis was made from; none for a model without one beside it.

    Raises:
        InvalidDiagnosis: The file is broken.
    """
    return tuple(dict.fromkeys(row.word("bench") for row in recorded_rows(path)))


def recorded_numbers(path: Path, bench: str) -> tuple[str, ...]:
    """Return which numbers of a bench its recordings stated themselves, such as ``mass``."""
    rows = [row for row in recorded_rows(path) if row.word("bench") == bench]
    stated = [row.table("bench_overrides").values for row in rows if "bench_overrides" in row]
    return tuple(sorted({key for numbers in stated for key in numbers}))


def recorded_rows(path: Path) -> list[CheckedTable]:
    """Return how the benches of a diagnosis were set up; empty for a model without one."""
    file = model_path(path).with_name(FILE)
    if model_path(path).name != MODEL or not file.is_file():
        return []
    table = diagnosis_table(file)
    return table.tables("recorded") if "recorded" in table else []


def bench_for(path: Path, stated: str | None, default: str) -> str:
    """Return the bench on which a model is used.

    Args:
        path: Model file, or a diagnosis: its folder or its ``diagnosis.json``.
        stated: Name or USD file of the bench that the user states, if any.
        default: Bench of a model that no diagnosis made.

    Raises:
        InvalidParameter: The diagnosis is of several benches, or not of the stated one.
    """
    if stated is not None:
        refuse_other_bench(path, {stated})
        return stated
    benches = recorded_benches(path)
    if len(benches) > 1:
        raise InvalidParameter(f"{path}: --bench must name one of its benches: {listed(benches)}")
    return benches[0] if benches else default


def refuse_other_bench(path: Path, benches: Collection[str]) -> None:
    """Refuse to use a diagnosis on benches that it was not made from.

    Args:
        path: Model file, which any bench may have, or a diagnosis.
        benches: Names or USD files.

    Raises:
        InvalidParameter: The diagnosis is of none of them, or not of all.
    """
    own = recorded_benches(path)
    if model_path(path) == path or not own:
        return
    for bench in benches:
        if Path(bench).stem not in own:
            raise InvalidParameter(
                f"{path}: a diagnosis is used on its own bench, {listed(own)}; it is to be used on "
                f"{bench}: name {model_path(path)} to carry its servo over"
            )
