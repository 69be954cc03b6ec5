"""Made-up logs in the format of Rhoban/bam."""

import json
from pathlib import Path
from typing import Any

import numpy as np


def bam_log(path: Path, *, kp: float = 16.0, motor: str = "sts3215", **changes: Any) -> Path:
    """Write a log of 200 rows at 100 Hz.

    Args:
        changes: Columns or stated values that differ; None leaves a column out.
    """
    time = np.arange(200) / 100.0
    position = 0.5 * np.sin(3.0 * time)
    columns: dict[str, Any] = {
        "timestamp": time,
        "goal_position": 0.6 * np.sin(3.0 * time + 0.2),
        "position": position,
        "speed": 1.5 * np.cos(3.0 * time),
        "load": np.zeros_like(time),
        "torque": None,
        "input_volts": np.full_like(time, 11.9) + 0.1 * (position > 0.0),
        "temp": 30.0 + time,
        "torque_enable": time < 1.5,
    }
    stated: dict[str, Any] = {"mass": 0.5, "length": 0.1, "kp": kp, "vin": 12.0, "motor": motor}
    columns |= {key: value for key, value in changes.items() if key in columns}
    stated |= {key: value for key, value in changes.items() if key not in columns}
    columns = {key: value.tolist() for key, value in columns.items() if value is not None}
    rows = zip(*columns.values(), strict=True)
    entries = [dict(zip(columns, row, strict=True)) for row in rows]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(stated | {"entries": entries}))
    return path
