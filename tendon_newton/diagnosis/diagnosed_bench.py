"""Which bench a diagnosis is of: whoever uses its model takes that bench.

A diagnosis is named by its folder or its ``diagnosis.json``, and then holds for its own benches.
The ``model.toml`` alone is a servo for any bench; unless a bench is named it stays on its own. A
known servo is named by a word, and is carried over to the spool of any bench.
"""

import logging
from collections.abc import Collection
from pathlib import Path

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.diagnosis.diagnosis_file import ANSWER, MODEL, diagnosis_table
from tendon_newton.diagnosis.known_servos import known_servo, known_servos, servo_alone
from tendon_newton.errors import InvalidParameter, listed, unknown_name
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

log = logging.getLogger(__name__)
RADIUS_TOLERANCE = 1e-3  # [1] of a radius, as between a policy's card and its bench


def model_path(path: Path) -> Path:
    """Return the model file of a diagnosis or of a known servo, or the path itself.

    Raises:
        UnknownName: A word is neither a file nor a known servo.
    """
    path = known_servo(path) or path
    if path.name == str(path) and not path.suffix and not path.exists():
        raise unknown_name("servo, file or folder", str(path), known_servos())
    if path.is_dir():
        return path / MODEL
    return path.with_name(MODEL) if path.suffix == ".json" else path


def open_model(path: str | Path, benches: Collection[Mechanism]) -> Model:
    """Return the model that a user names, for benches that it may be used on.

    Where its spool has another radius than those of the benches a warning says so.

    Args:
        path: Model file, a diagnosis (its folder or its ``diagnosis.json``), or a known servo.
        benches: A known servo is carried over to their spool.

    Raises:
        InvalidParameter: A diagnosis is of another bench, or the benches have several spools.
        TendonNewtonError: The file is damaged or missing.
    """
    path = Path(path)
    home = known_servo(path)
    if home is None:
        refuse_other_bench(path, [bench.name for bench in benches])
    model = load_model(model_path(path))
    if home is not None:
        return servo_alone(model, common_spool(path, benches))
    radius = model.actuator.values.get("spool_radius")
    if isinstance(radius, float):
        warn_of_other_spool(path, radius, benches)
    return model


def warn_of_other_spool(path: Path, radius: float, benches: Collection[Mechanism]) -> None:
    """Say where a model's radius of the spool [m] is not that of the benches' assets."""
    others = {
        bench.name: tendon.spool_radius
        for bench in benches
        for tendon in bench.tendons
        if abs(radius / tendon.spool_radius - 1.0) > RADIUS_TOLERANCE
    }
    if others:
        of_assets = listed(f"{other:g} m of {bench}" for bench, other in others.items())
        log.warning("%s: its spool_radius of %g m counts, not %s", path, radius, of_assets)


def common_spool(path: Path, benches: Collection[Mechanism]) -> float:
    """Return the radius of the spool that benches have in common [m]."""
    radii = {tendon.spool_radius for bench in benches for tendon in bench.tendons}
    if len(radii) != 1:
        raise InvalidParameter(
            f"{path}: a known servo is carried over to one spool; the benches "
            f"{listed(bench.name for bench in benches)} have radii of "
            f"{listed(f'{radius:g}' for radius in sorted(radii))} m: use them one at a time"
        )
    return radii.pop()


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
    """Return how the benches of a diagnosis were set up; empty for a model without one.

    A known servo's stand is no bench of it.
    """
    if known_servo(path) is not None:
        return []
    model = model_path(path)
    file = model.with_name(ANSWER)
    if model.name != MODEL or not file.is_file():
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
