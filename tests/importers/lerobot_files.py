"""Made-up LeRobotDatasets."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import parquet

JOINTS = ("shoulder_pan.pos", "elbow_flex.pos", "gripper.pos")
ROWS = 60


def lerobot_dataset(
    folder: Path, *, scale: float = 1.0, fixed: bool = True, **changes: Any
) -> Path:
    """Write three episodes of an arm in two files; the second begins within an episode.

    Args:
        scale: Size of the first two joints' motion; the gripper's is in percent.
        fixed: Whether rows are lists of a fixed length, as newer programs write them.
        changes: What ``info.json`` says otherwise.
    """
    (folder / "meta").mkdir(parents=True, exist_ok=True)
    feature = {"dtype": "float32", "shape": [3], "names": list(JOINTS)}
    info = {
        "codebase_version": "v3.0",
        "robot_type": "so101_follower",
        "fps": 30,
        "features": {"action": feature, "observation.state": feature},
    }
    (folder / "meta" / "info.json").write_text(json.dumps(info | changes))
    episode = np.repeat(np.arange(3), ROWS)
    time = np.tile(np.arange(ROWS) / 30.0, 3)
    state = np.stack([scale * np.sin(time + e) for e in (0, 1)] + [50.0 + 10.0 * time], axis=1)
    table = pa.table(
        {
            "action": lists(state + np.array([0.01, 0.01, 1.0]), fixed=fixed),
            "observation.state": lists(state, fixed=fixed),
            "timestamp": pa.array(time, pa.float32()),
            "frame_index": pa.array(np.tile(np.arange(ROWS), 3), pa.int64()),
            "episode_index": pa.array(episode, pa.int64()),
        }
    )
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True, exist_ok=True)
    cut = ROWS + ROWS // 2
    parquet.write_table(table.slice(0, cut), chunk / "file-000.parquet")
    parquet.write_table(table.slice(cut), chunk / "file-001.parquet")
    return folder


def lists(values: np.ndarray, *, fixed: bool) -> pa.Array:
    """Return rows of single-precision numbers."""
    flat = pa.array(values.astype(np.float32).ravel())
    if fixed:
        return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
    return pa.ListArray.from_arrays(np.arange(0, values.size + 1, values.shape[1]), flat)


def lerobot_calibration(path: Path) -> Path:
    """Write the calibration of the arm: an eighth of a turn is 100 percent of each joint."""
    row = {"id": 1, "drive_mode": 0, "homing_offset": 0, "range_min": 1024, "range_max": 2048}
    names = (name.removesuffix(".pos") for name in JOINTS)
    path.write_text(json.dumps(dict.fromkeys(names, row)))
    return path
