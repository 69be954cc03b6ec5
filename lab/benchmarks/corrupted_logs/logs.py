"""Clean logs of an arm, made from a seed, and how any log is written: a LeRobotDataset of v3."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from lab.exams.oscillations.plant import Array, Loops, run
from lab.exams.wear.units import COUNT, teleoperated

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex")
EPISODES, RATE, DURATION = 3, 30, 15.0
ROWS = round(RATE * DURATION)
INDICES = ("frame_index", "episode_index", "index", "task_index")


@dataclass(kw_only=True)
class Log:
    """Episodes of an arm; a fault changes its arrays in place."""

    time: Array  # [s], shape (E, T)
    action: Array  # [deg], shape (E, T, J)
    state: Array  # [deg], shape (E, T, J)
    kept: np.ndarray  # Rows that were written, shape (E, T)

    def copy(self) -> "Log":
        """Return a copy."""
        return Log(**{name: values.copy() for name, values in vars(self).items()})


def clean_logs(rng: np.random.Generator, count: int) -> Iterator[Log]:
    """Draw clean logs: servos with friction, a little play, delay and a load, each of its own."""
    steps, joints = round(1e3 * DURATION), len(JOINTS)
    shape = (count, EPISODES, joints)

    def spread(low: float, high: float) -> Array:
        own = np.exp(rng.uniform(np.log(low), np.log(high), (count, 1, joints)))
        return np.ravel(own + np.zeros(shape))

    damping, zero = spread(25.0, 60.0), np.zeros(int(np.prod(shape)))
    stiffness = damping * spread(10.0, 18.0)  # 55 to 100 ms of lag
    friction = stiffness * spread(4e-3, 1.5e-2)
    loops = Loops(
        outer=zero,
        servo_gain=zero + 1.0,
        servo_integral=zero,
        strength=stiffness,
        damping=damping,
        coulomb=friction,
        static=1.3 * friction,
        slow=spread(0.05, 0.3),
        play=spread(3e-3, 1.5e-2),
        load=spread(0.1, 0.3),
        gear=2.0 * np.pi * spread(40.0, 80.0),
        delay=spread(5e-3, 2e-2),
        gain=zero,
        integral=zero,
        row=zero + 1.0 / RATE,
        spring=stiffness * spread(0.01, 0.06),
        rest=zero,
    )
    goal = np.stack([teleoperated(rng, steps) for _ in zero], axis=1)
    _, angle, _ = run(loops, goal, 3e-4 * rng.normal(size=goal.shape), COUNT)
    at = np.round(1e3 * np.arange(ROWS) / RATE).astype(np.intp)
    action, state = (
        np.rad2deg(values[at]).reshape(ROWS, *shape).transpose(1, 2, 0, 3)
        for values in (goal, angle)
    )
    time = np.tile(np.arange(ROWS) / RATE, (EPISODES, 1))
    for one, other in zip(action, state, strict=True):
        kept = np.ones(time.shape, dtype=np.bool_)
        yield Log(time=time.copy(), action=one, state=other, kept=kept)


def write_log(folder: Path, log: Log) -> None:
    """Write a log as a LeRobotDataset."""
    names = [f"{name}.pos" for name in JOINTS]
    feature = {"dtype": "float32", "shape": [len(JOINTS)], "names": names}
    plain = {"shape": [1], "names": None}
    features = {
        "action": feature,
        "observation.state": feature,
        "timestamp": {"dtype": "float32", **plain},
        **{name: {"dtype": "int64", **plain} for name in INDICES},
    }
    count = int(log.kept.sum())
    info = {
        "codebase_version": "v3.0",
        "robot_type": "so101_follower",
        "fps": RATE,
        "total_episodes": EPISODES,
        "total_frames": count,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "splits": {"train": f"0:{EPISODES}"},
        "features": features,
    }
    lengths = log.kept.sum(axis=1)
    table = {
        "action": numbers(log.action[log.kept]),
        "observation.state": numbers(log.state[log.kept]),
        "timestamp": pa.array(log.time[log.kept], pa.float32()),
        "frame_index": np.concatenate([np.arange(length) for length in lengths]),
        "episode_index": np.repeat(np.arange(EPISODES), lengths),
        "index": np.arange(count),
        "task_index": np.zeros(count, dtype=np.int64),
    }
    ends = np.cumsum(lengths)
    episodes = {
        "episode_index": np.arange(EPISODES),
        "tasks": [["pick"]] * EPISODES,
        "length": lengths,
        "data/chunk_index": np.zeros(EPISODES, dtype=np.int64),
        "data/file_index": np.zeros(EPISODES, dtype=np.int64),
        "dataset_from_index": ends - lengths,
        "dataset_to_index": ends,
    }
    tasks = {"task_index": [0], "__index_level_0__": ["pick"]}
    for name, columns in (
        ("data/chunk-000/file-000", table),
        ("meta/episodes/chunk-000/file-000", episodes),
        ("meta/tasks", tasks),
    ):
        path = folder / f"{name}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(pa.table(columns), path)
    (folder / "meta" / "info.json").write_text(json.dumps(info))


def numbers(rows: Array) -> pa.Array:
    """Return rows of single-precision numbers."""
    return pa.array(rows.astype(np.float32).tolist(), pa.list_(pa.float32()))
