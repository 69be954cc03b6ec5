"""Calibrations as TOML files, which logs name by their identifier."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tendon_hardware.errors import InvalidCalibration
from tendon_hardware.load_cells.calibration import CalibrationPoint, LoadCellCalibration
from tendon_hardware.load_cells.calibration_fit import fit_calibration
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml

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
    table = CheckedTable(read_toml(path, InvalidCalibration), str(path), InvalidCalibration)
    refuse_unknown_keys(
        table.values, (*SETTING_KEYS, *RESULT_KEYS, "points"), table.where, InvalidCalibration
    )
    points, settings = read_points(table), read_settings(table)
    try:
        calibration = fit_calibration(points, **settings)
    except InvalidCalibration as error:
        raise InvalidCalibration(f"{path}: {error}") from error
    if table.values.get("identifier") != calibration.identifier:
        raise InvalidCalibration(
            f"{path}: its identifier must be {calibration.identifier}, the hash of its points and "
            f"settings; it is {table.values.get('identifier')!r}: the file was changed by hand"
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
    points = read_points(CheckedTable(table, str(path), InvalidCalibration))
    del table["points"]
    return table, points


def read_points(table: CheckedTable) -> list[CalibrationPoint]:
    """Read the ``[[points]]`` tables."""
    points: list[CalibrationPoint] = []
    for row in table.tables("points"):
        refuse_unknown_keys(row.values, POINT_KEYS, row.where, InvalidCalibration)
        direction = row.word("direction")
        if direction not in ("up", "down"):
            row.refuse("direction", "up or down")
        numbers = {key: row.number(key) for key in ("mass", "counts", "sigma", "duration")}
        readings = int(row.number("readings"))
        points.append(CalibrationPoint(**numbers, direction=direction, readings=readings))
    return points


def read_settings(table: CheckedTable) -> dict[str, Any]:
    """Read what stands beside the points."""
    return {
        "cell": table.word("cell"),
        "date": table.word("date"),
        "gain": int(table.number("gain")),
        "rate": table.number("rate"),
        "gravity": table.number("gravity"),
    }
