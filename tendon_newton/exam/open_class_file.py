"""Read from a diagnosis the causes that it could not tell apart."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tendon_newton.data.bench_overrides import read_bench_overrides
from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.model_file import load_model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.diagnosis_file import (
    PROMISE,
    came,
    read_number,
    read_word,
    state_diagnosis,
    state_estimate,
)
from tendon_newton.diagnosis.explanation import Explanation, OpenClass, Setting, model_without
from tendon_newton.errors import (
    InvalidDiagnosis,
    NothingToSeparate,
    TendonNewtonError,
    listed,
    shown,
)
from tendon_newton.identification.noise_floor import NoiseFloor

FILE = "diagnosis.json"
ANSWER = "answer"
"""Stands for the cause where a whole answer is looked at."""


def read_open_class(folder: Path, cause: str | None = None) -> OpenClass:
    """Read a class of causes that a diagnosis could not tell apart.

    Args:
        folder: Holds ``diagnosis.json`` and ``model.toml``.
        cause: The named cause, of several; by default the first that stands for a class.

    Raises:
        NothingToSeparate: There is no such class.
        InvalidDiagnosis: The cause stands for none, or a file is broken.
    """
    path = folder / FILE
    table = read_json(path, InvalidDiagnosis, PROMISE)
    stated = state_diagnosis(table, str(path))
    classes = [effect.name for effect in stated.effects if effect.indistinguishable_from]
    if not classes:
        raise NothingToSeparate(
            f"{path}: an experiment separates causes that a diagnosis could not tell apart; it "
            f"names {listed([e.name for e in stated.effects])}, and leaves none of them open"
        )
    chosen = cause or classes[0]
    if chosen not in classes:
        raise InvalidDiagnosis(
            f"{path}: {chosen!r} must be a named cause that was not told from others; "
            f"those are {listed(classes)}"
        )
    effect = next(row for row in table["effects"] if row["name"] == chosen)
    where = f"{path}: {shown(chosen)}"
    return OpenClass(
        explanations=tuple(
            read_explanation(row, where) for row in read_rows(effect, "explanations", where)
        ),
        without=model_without(load_model(folder / "model.toml"), chosen),
        settings=tuple(read_setting(row, path) for row in read_rows(table, "recorded", str(path))),
        noise=read_noise(table, str(path)),
        scale=read_scale(table, str(path)),
    )


def read_answer(folder: Path) -> OpenClass:
    """Read a whole diagnosis as the only explanation of its data, with all numbers it fitted.

    Args:
        folder: Holds ``diagnosis.json`` and ``model.toml``.

    Raises:
        InvalidDiagnosis: A file is broken.
    """
    path = folder / FILE
    table = read_json(path, InvalidDiagnosis, PROMISE)
    stated, model = state_diagnosis(table, str(path)), load_model(folder / "model.toml")
    fitted = table.get("fitted", {})
    if not isinstance(fitted, dict):
        raise InvalidDiagnosis(f"{path}: fitted must be an object; it is {came(table, 'fitted')}")
    own = {name: state_estimate(row, f"{path}: {shown(name)}") for name, row in fitted.items()}
    numbers = {model.actuator.name: own} | {e.name: dict(e.parameters) for e in stated.effects}
    return OpenClass(
        explanations=(Explanation(cause=ANSWER, numbers=numbers),),
        without=model,
        settings=tuple(read_setting(row, path) for row in read_rows(table, "recorded", str(path))),
        noise=read_noise(table, str(path)),
        scale=read_scale(table, str(path)),
    )


def read_rows(table: Mapping[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """Return the objects under a key."""
    rows = table.get(key)
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise InvalidDiagnosis(
            f"{where}: {key} must be a list of objects; it is {came(table, key)}. "
            "A diagnosis by this release lists them: diagnose the data again"
        )
    return rows


def read_explanation(row: Mapping[str, Any], where: str) -> Explanation:
    """Read one way to explain the data."""
    numbers = row.get("numbers")
    if not isinstance(numbers, dict) or not all(isinstance(v, dict) for v in numbers.values()):
        raise InvalidDiagnosis(
            f"{where}: numbers must be an object of objects; it is {came(row, 'numbers')}"
        )
    return Explanation(
        cause=read_word(row, "cause", where),
        numbers={
            owner: {name: state_estimate(value, f"{where}: {name}") for name, value in own.items()}
            for owner, own in numbers.items()
        },
    )


def read_setting(row: Mapping[str, Any], path: Path) -> Setting:
    """Read how a bench was set up."""
    where = f"{path}: recorded"
    overrides = row.get("actuator_overrides", {})
    numbers = (
        {key: finite_number(value) for key, value in overrides.items()}
        if isinstance(overrides, dict)
        else {"actuator_overrides": None}
    )
    known = {key: number for key, number in numbers.items() if number is not None}
    if len(known) < len(numbers):
        raise InvalidDiagnosis(
            f"{where}: actuator_overrides must be an object of numbers; "
            f"it is {came(row, 'actuator_overrides')}"
        )
    try:
        bench = read_bench_overrides(row.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDiagnosis(f"{where}: {error}") from error
    return Setting(
        bench=read_word(row, "bench", where),
        seconds=read_number(row, "seconds", where),
        bench_overrides=bench,
        actuator_overrides=known,
    )


def read_scale(table: Mapping[str, Any], where: str) -> BenchScale:
    """Read how large the benches are; without a word they are of the nominal size."""
    own = table.get("scale", {})
    if not isinstance(own, dict):
        raise InvalidDiagnosis(f"{where}: scale must be an object; it is {came(table, 'scale')}")
    numbers = {
        key: read_number(own, key, f"{where}: scale")
        for key in ("force", "travel", "turn")
        if key in own
    }
    for key, value in numbers.items():
        if value <= 0.0:
            raise InvalidDiagnosis(f"{where}: scale: {key} must be > 0; it is {value:g}")
    return BenchScale(**numbers, is_shaft=own.get("is_shaft") is True)


def read_noise(table: Mapping[str, Any], where: str) -> NoiseFloor:
    """Read the noise of the sensors."""
    floor = table.get("noise_floor")
    if not isinstance(floor, dict):
        raise InvalidDiagnosis(
            f"{where}: noise_floor must be an object; it is {came(table, 'noise_floor')}"
        )
    force = floor.get("force")
    return NoiseFloor(
        theta=read_number(floor, "theta", f"{where}: noise_floor"),
        force=None if force is None else read_number(floor, "force", f"{where}: noise_floor"),
    )
