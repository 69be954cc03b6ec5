"""Made-up logs and parameter files in the format of Rhoban/bam."""

import json
from pathlib import Path
from typing import Any

import numpy as np

M6 = {
    "kt": 1.3,
    "R": 2.6,
    "armature": 0.02,
    "q_offset": -0.05,
    "command_delay": 0.004,
    "friction_base": 0.05,
    "friction_stribeck": 0.02,
    "friction_viscous": 0.03,
    "load_friction_motor": 0.2,
    "load_friction_external": 0.25,
    "load_friction_motor_stribeck": 0.1,
    "load_friction_external_stribeck": 0.0,
    "load_friction_motor_quad": 0.008,
    "load_friction_external_quad": 0.0,
    "dtheta_stribeck": 0.4,
    "alpha": 1.5,
    "max_velocity": 5.0,
    "error_gain_ratio": 1.1,
    "model": "m6",
    "actuator": "sts3215",
}
"""Parameters of the richest of their models."""


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


def bam_parameters(path: Path, **changes: Any) -> Path:
    """Write a parameter file; None leaves a key out."""
    table = {key: value for key, value in (M6 | changes).items() if value is not None}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(table))
    return path
