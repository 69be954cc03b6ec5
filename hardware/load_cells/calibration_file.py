"""Calibrations as TOML files, which logs name by their identifier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hardware.errors import InvalidCalibration
from hardware.load_cells.calibration import CalibrationPoint, LoadCellCalibration
from hardware.load_cells.calibration_fit import fit_calibration
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.files.values import are_tables

SETTING_KEYS = ("cell", "gain", "rate", "gravity", "date")
RESULT_KEYS = ("identifier", "tare", "slope", "residual", "hysteresis", "r_squared")
POINT_KEYS = ("mass", "direction", "counts", "sigma", "readings", "duration")


def write_calibration(path: Path, calibration: LoadCellCalibration) -> None:
    """Write a calibration whole or not at all."""
    settings = {key: getattr(calibration, key) for key in SETTING_KEYS}
    results = {key: getattr(calibration, key) for key in RESULT_KEYS}
    write_toml(
        path, {**settings, **results}, points=[asdict(point) for point in calibration.points]
    )


def load_calibration(path: Path) -> LoadCellCalibration:
    """Read a calibration and make sure that nobody has changed it.

    The line is fitted again from the points in the file; results are there for a reader.

    Raises:
        InvalidCalibration: The file is no calibration, or has the identifier of another one.
    """
    if not path.is_file():
        raise InvalidCalibration(f"{path}: a calibration is a TOML file; there is none")
    table = read_toml(path, InvalidCalibration)
    refuse_unknown_keys(
        table, (*SETTING_KEYS, *RESULT_KEYS, "points"), str(path), InvalidCalibration
    )
    try:
        points = read_points(table.get("points"))
        calibration = fit_calibration(points, **read_settings(table))
    except InvalidCalibration as error:
        raise InvalidCalibration(f"{path}: {error}") from error
    if table.get("identifier") != calibration.identifier:
        raise InvalidCalibration(
            f"{path}: its identifier must be {calibration.identifier}, the hash of its points and "
            f"settings; it is {table.get('identifier')!r}: the file was changed by hand"
        )
    return calibration


def write_partial(
    path: Path, settings: Mapping[str, Any], points: Sequence[CalibrationPoint]
) -> None:
    """Keep the points of a calibration that is not complete."""
    write_toml(path, dict(settings), points=[asdict(point) for point in points])


def load_partial(path: Path) -> tuple[dict[str, Any], list[CalibrationPoint]]:
    """Read the settings and points of an interrupted calibration."""
    table = read_toml(path, InvalidCalibration)
    try:
        points = read_points(table.pop("points", []))
    except InvalidCalibration as error:
        raise InvalidCalibration(f"{path}: {error}") from error
    return table, points


def read_points(rows: Any) -> list[CalibrationPoint]:
    """Read the ``[[points]]`` tables."""
    if not are_tables(rows):
        raise InvalidCalibration("points must be an array of tables, [[points]]")
    points: list[CalibrationPoint] = []
    for index, row in enumerate(rows):
        where = f"[[points]] {index}"
        refuse_unknown_keys(row, POINT_KEYS, where, InvalidCalibration)
        numbers = {key: number(row, key, where) for key in ("mass", "counts", "sigma", "duration")}
        if row.get("direction") not in ("up", "down"):
            raise InvalidCalibration(f"{where}: direction must be up or down")
        points.append(
            CalibrationPoint(
                **numbers,
                direction=row["direction"],
                readings=int(number(row, "readings", where)),
            )
        )
    return points


def read_settings(table: Mapping[str, Any]) -> dict[str, Any]:
    """Read what stands beside the points."""
    for key in ("cell", "date"):
        if not isinstance(table.get(key), str):
            raise InvalidCalibration(f"{key} must be a string; it is {table.get(key)!r}")
    return {
        "cell": table["cell"],
        "date": table["date"],
        "gain": int(number(table, "gain", "calibration")),
        "rate": number(table, "rate", "calibration"),
        "gravity": number(table, "gravity", "calibration"),
    }


def number(table: Mapping[str, Any], key: str, where: str) -> float:
    """Read a number."""
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidCalibration(f"{where}: {key} must be a number; it is {value!r}")
    return float(value)
