"""Small made-up logs for tests of formats."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import write_model
from tendon_newton.data.recording import Recording
from tests.made import stated_model

ROWS = 20


def recording(name: str = "run_0.csv", **changes: Any) -> Recording:
    """A made-up recording of a finger; ``changes`` replace its fields."""
    time = np.arange(ROWS) / 80.0
    theta = 0.5 * np.sin(2.0 * np.pi * time)[:, None]
    fields: dict[str, Any] = {
        "name": name,
        "bench": "finger",
        "time": time,
        "command": theta + 0.5,
        "motor_position": theta,
        "motor_velocity": np.pi * np.cos(2.0 * np.pi * time)[:, None],
        "force": np.full((ROWS, 1), 2.1) + 0.01 * time[:, None],
    }
    return Recording(**(fields | changes))


def dataset(folder: Path) -> Path:
    """Write a dataset of one train and one test recording."""
    write_dataset(folder, [recording("train.csv")], [recording("test.csv", force=None)])
    return folder


def model(path: Path) -> Path:
    """Write the nominal model."""
    values = {"gain": 4.2, "spool_radius": 0.0125}
    write_model(path, stated_model("ideal", values))
    return path


def xl330_log(
    path: Path, *, kp: float = 200.0, lag: float = 0.0, unsigned: bool = True, **changes: Any
) -> Path:
    """Write a made-up log of a servo on a pendulum in the format of the real ones.

    Args:
        lag: Delay of the speed register [s].
        unsigned: Write negative duty as the real logs have it, 65536 counts too high.
    """
    time = 0.0035 + np.arange(600) / 188.0
    goal = np.sin(4.0 * time)
    position = np.round(0.7 * np.sin(4.0 * time - 0.3) * 4096.0 / (2.0 * np.pi))
    position *= 2.0 * np.pi / 4096.0
    speed = np.round(2.8 * np.cos(4.0 * (time - lag) - 0.3) / 0.0239808)
    load = np.round(np.clip(kp * 651.9 / 226560.0 * (goal - position), -1.0, 1.0) * 885.0)
    load = np.where(load < 0.0, load + 65536.0, load) if unsigned else load
    entries = [
        {
            "timestamp": float(time[k]),
            "position": float(position[k]),
            "speed": float(speed[k] * 0.0239808),
            "load": int(load[k]),
            "input_volts": 7.3,
            "temp": 29,
            "goal_position": float(goal[k]),
            "torque_enable": bool(k < 500),
        }
        for k in range(time.size)
    ]
    stated = {"mass": 0.49, "length": 0.1, "kp": kp, "vin": 7.4, "motor": "xl330"}
    stated["trajectory"] = path.stem.split("_", 1)[-1]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(stated | {"entries": entries} | changes))
    return path
