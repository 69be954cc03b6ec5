"""A sound log of two joints, and the doors by which it may come in."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from tests.importers.lerobot_files import lists

Array = np.ndarray
Columns = dict[str, Array]
Edit = Callable[[str], str]
Door = Callable[[Path, list[Columns]], list[str]]
"""Writes runs into a folder, and gives the command that takes them in."""

RATE, ROWS = 80.0, 960
COUNT = 2.0 * np.pi / 4096.0
OURS = {
    "t": "t", "goal": "theta_d", "q": "theta", "speed": "theta_dot", "current": "current",
    "voltage": "voltage", "force": "force", "enabled": "enabled",
}  # fmt: skip


def followed(goal: Array, late: int = 3, lag: float = 4.0) -> Array:
    """Return where a servo stands that follows late, in counts of its encoder [rad].

    Args:
        late: Rows after which it moves.
        lag: Its time constant after that, in rows.
    """
    theta = np.full_like(goal, goal[0])
    for k in range(1, len(goal)):
        theta[k] = theta[k - 1] + (goal[max(0, k - late)] - theta[k - 1]) / lag
    return COUNT * np.round(theta / COUNT)


def sound(seed: int = 0) -> Columns:
    """Return a log in which nothing is wrong: two joints go from place to place, and rest."""
    rng = np.random.default_rng(seed)
    columns: Columns = {"t": np.arange(ROWS) / RATE}
    for joint in range(2):
        instants = np.r_[0.0, 0.6, 0.6 + np.cumsum(rng.uniform(0.2, 0.7, 60))]
        places = np.r_[0.0, 0.0, rng.uniform(-0.9, 0.9, 60)]
        goal = np.interp(columns["t"], instants, places)
        columns |= {f"goal_{joint}": goal, f"q_{joint}": followed(goal)}
    return columns


def ours(name: str) -> str:
    """Return our name of a log's column."""
    kind, _, joint = name.partition("_")
    return f"{OURS[kind]}_{joint}" if joint else OURS[kind]


def csv_logs(
    bench: str = "servo", *, of: Edit = str, mapping: Edit = str, suffix: str = ".csv"
) -> Door:
    """Return the door of anybody's CSV files and a mapping.

    Args:
        of: What becomes of each file's text.
        mapping: What becomes of the mapping's text.
    """

    def door(folder: Path, runs: list[Columns]) -> list[str]:
        (folder / "logs").mkdir()
        for number, run in enumerate(runs):
            text = of(csv_text(run))
            (folder / "logs" / f"run_{number}{suffix}").write_text(text, encoding="utf-8")
        lines = [f'bench = "{bench}"']
        lines += ['joints = ["pan", "lift"]'] if "q_1" in runs[0] else []
        lines += ["[columns]", *(f'{ours(name)} = {{column = "{name}"}}' for name in runs[0])]
        lines += [] if any(n.startswith("speed") for n in runs[0]) else [
            'theta_dot = {derive = "theta"}'
        ]  # fmt: skip
        (folder / "mapping.toml").write_text(mapping("\n".join(lines) + "\n"))
        words = ["--mapping", str(folder / "mapping.toml"), "--out", str(folder / "out")]
        return ["import", "mapped", str(folder / "logs"), *words]

    return door


def csv_text(columns: Columns) -> str:
    """Write columns of numbers or words, with their names."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n"


def own_dataset(folder: Path, runs: list[Columns], bench: str = "servo") -> list[str]:
    """Write a dataset of our own format; the last run is held out."""
    (folder / "own").mkdir()
    listed: list[str] = []
    for k, run in enumerate(runs):
        speeds = {n.replace("q", "speed"): slope(run, n) for n in run if n.startswith("q")}
        columns = {ours(name): values for name, values in {**speeds, **run}.items()}
        (folder / "own" / f"run_{k}.csv").write_text(csv_text(columns))
        split = "test" if k == len(runs) - 1 else "train"
        listed.append(
            f'[[recordings]]\nfile = "run_{k}.csv"\nbench = "{bench}"\nsplit = "{split}"\n'
        )
    (folder / "own" / "dataset.toml").write_text("\n".join(listed))
    return ["doctor", str(folder / "own")]


def slope(run: Columns, name: str) -> Array:
    """Return the slope of an angle as a driver would log it, whatever its stamps say."""
    return np.gradient(run[name]) * RATE


def lerobot(folder: Path, runs: list[Columns]) -> list[str]:
    """Write a LeRobotDataset of v3, an episode a run, in radians."""
    feature = {"shape": [2], "names": ["pan.pos", "lift.pos"]}
    info = {"codebase_version": "v3.0", "fps": RATE}
    info |= {"features": {"action": feature, "observation.state": feature}}
    (folder / "arm" / "meta").mkdir(parents=True)
    (folder / "arm" / "meta" / "info.json").write_text(json.dumps(info))
    every = {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}
    pairs = {kind: np.stack([every[f"{kind}_0"], every[f"{kind}_1"]], 1) for kind in ("goal", "q")}
    table = {
        "action": lists(pairs["goal"], fixed=True),
        "observation.state": lists(pairs["q"], fixed=True),
        "timestamp": every["t"],
        "episode_index": np.repeat(np.arange(len(runs)), [len(run["t"]) for run in runs]),
    }
    path = folder / "arm" / "data" / "chunk-000" / "file-000.parquet"
    path.parent.mkdir(parents=True)
    parquet.write_table(pa.table(table), path)
    return ["doctor", str(folder / "arm")]


def lone(run: Columns) -> None:
    """Leave one joint, whose columns have no number."""
    for name in list(run):
        if name.endswith("_1"):
            del run[name]
        elif name.endswith("_0"):
            run[name.removesuffix("_0")] = run.pop(name)
