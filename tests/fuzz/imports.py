"""Sound logs of other programs to spoil, and how they are read."""

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomli_w

from tendon_newton.data.importers.lerobot import LeRobotUnits, read_lerobot
from tendon_newton.data.importers.mapped import read_mapped
from tests.fuzz.mutations import change_lines, change_table, flip
from tests.importers.lerobot_files import lerobot_dataset

MAPPING: dict[str, Any] = {
    "bench": "spring_weak",
    "files": "run*",
    "columns": {
        "t": {"column": "time_ms", "unit": "ms"},
        "theta_d": {"column": "goal", "unit": "deg", "sign": -1},
        "theta": {"column": "angle", "unit": "deg", "sign": -1, "offset": 0.1},
        "theta_dot": {"derive": "theta"},
        "force": {"column": "grams", "unit": "g"},
    },
    "model": {"kind": "ideal", "gain": 4.0, "spool_radius": 0.0125},
    "fit": ["gain"],
}
NAMES = ("time_ms", "goal", "angle", "grams")
TIME = np.arange(40) / 100.0
VALUES = np.stack([1e3 * TIME, 33.0 * np.sin(TIME), 30.0 * np.sin(TIME), 100.0 + TIME], axis=1)
JSON_ROWS: list[dict[str, float]] = [dict(zip(NAMES, row, strict=True)) for row in VALUES.tolist()]


def mapping_file(folder: Path) -> Path:
    """Write a mapping beside a folder with a log."""
    (folder / "logs").mkdir()
    lines = [",".join(NAMES), *(",".join(map(str, row)) for row in VALUES.tolist())]
    (folder / "logs" / "run_1.csv").write_text("\n".join(lines) + "\n")
    (folder / "mapping.toml").write_text(tomli_w.dumps(MAPPING))
    return folder / "mapping.toml"


def read_with_mapping(path: Path) -> None:
    """Read the logs by a spoilt mapping."""
    read_mapped(path.parent / "logs", path, lambda _: 0.0125)


def mapped_csv(folder: Path) -> Path:
    """Write a CSV log that a mapping explains."""
    return mapping_file(folder).parent / "logs" / "run_1.csv"


def mapped_json(folder: Path) -> Path:
    """Write a JSON log that a mapping explains."""
    mapped_csv(folder).unlink()
    (folder / "logs" / "run_1.json").write_text(json.dumps(JSON_ROWS))
    return folder / "logs" / "run_1.json"


def read_mapped_folder(path: Path) -> None:
    """Read a spoilt log by its mapping."""
    read_mapped(path.parent, path.parents[1] / "mapping.toml", lambda _: 0.0125)


def change_json(content: bytes, rng: Random) -> bytes:
    """Change a value of the log, or its text."""
    if rng.random() < 0.5:
        return rng.choice((flip, change_lines))(content, rng)
    return json.dumps(change_table(json.loads(content), rng)).encode()


def lerobot_rows(folder: Path) -> Path:
    """Write a LeRobotDataset and return its first file of rows."""
    return lerobot_dataset(folder / "arm") / "data" / "chunk-000" / "file-000.parquet"


def lerobot_info(folder: Path) -> Path:
    """Write a LeRobotDataset and return what describes it."""
    return lerobot_dataset(folder / "arm") / "meta" / "info.json"


def read_lerobot_rows(path: Path) -> None:
    """Read the dataset of spoilt rows."""
    read_lerobot(path.parents[2], units=LeRobotUnits(unit="deg"))


def read_lerobot_info(path: Path) -> None:
    """Read the dataset of a spoilt description."""
    read_lerobot(path.parents[1], units=LeRobotUnits(unit="deg"))
