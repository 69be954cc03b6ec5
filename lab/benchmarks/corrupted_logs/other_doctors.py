"""What `lerobot-doctor` and `lerobot-lint` find, in the benchmark's words; prints JSON.

Runs in an interpreter that has both and nothing of ours: ``python other_doctors.py LOGS``. The
logs are handed to `lerobot-lint`'s own engine by a reader of ours in place of lerobot's, which
needs torch. Its notes are left out; of `lerobot-doctor` its warnings and failures count.
"""

# pyright: reportMissingImports=false

import argparse
import io
import json
import re
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from pyarrow import parquet

LINT: dict[str, tuple[str, ...]] = {
    "FROZEN_STATE": ("frozen_read", "stalled_recorder"),
    "DISCONTINUITY": ("failed_read", "seam"),
    "JITTER": ("failed_read", "seam"),
    "DEAD_JOINT": ("frozen_read",),
    "SATURATED_JOINT": ("held",),
    "ACTION_STATE_DIVERGENCE": ("does_not_follow",),
    "ACTION_RANGE_MISMATCH": ("scale", "offset"),
    "TIMESTAMP_NON_MONOTONIC": ("clock_disorder",),
    "FRAME_DROPS": ("missing_rows", "clock_leap"),
    "FPS_MISMATCH": ("missing_rows", "clock_leap"),
}
"""Check of `lerobot-lint`, and the kinds that it may mean; each counts."""
DOCTOR: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("monotonic", ("clock_disorder",)),
    ("gap", ("missing_rows", "clock_leap")),
    ("dropped", ("missing_rows", "clock_leap")),
    ("fps", ("missing_rows", "clock_leap")),
    ("frozen", ("frozen_read", "stalled_recorder", "lost_command")),
    ("static", ("frozen_read", "stalled_recorder", "lost_command")),
    ("stuck", ("frozen_read", "stalled_recorder", "lost_command")),
    ("jump", ("failed_read", "seam")),
    ("outlier", ("failed_read", "seam")),
    ("clipped", ("held",)),
    ("shift", ("calibration_jump",)),
)
"""Words of `lerobot-doctor`, and the kinds that they may mean; each counts."""
IGNORED = ("policy", "chunk", "metadata", "README", "stats", "task", "video", "hub")


def main() -> None:
    """Print what each program finds in each log."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path, help="folder of the logs")
    logs = sorted(path for path in parser.parse_args().logs.iterdir() if path.is_dir())
    found = {
        "lerobot-doctor": {log.name: by_doctor(log) for log in logs},
        "lerobot-lint": {log.name: by_lint(log) for log in logs},
    }
    sys.stdout.write(json.dumps(found) + "\n")


def by_doctor(log: Path) -> list[dict[str, Any]]:
    """Return warnings and failures of `lerobot-doctor`."""
    from lerobot_doctor.dataset_loader import load_dataset
    from lerobot_doctor.runner import run_checks

    with redirect_stdout(io.StringIO()):
        report = run_checks(load_dataset(str(log)))
    found: list[dict[str, Any]] = []
    for result in report.results:
        for one in result.messages:
            words = one.message
            if one.severity.value == "PASS" or any(w.lower() in words.lower() for w in IGNORED):
                continue
            row: dict[str, Any] = {}
            if episode := re.search(r"[Ee]pisode (\d+)", words):
                row["episode"] = int(episode[1])
            kinds = next((k for w, k in DOCTOR if w in words.lower()), (words[:40],))
            found += [row | {"kind": kind} for kind in kinds]
    return found


def by_lint(log: Path) -> list[dict[str, Any]]:
    """Return errors and warnings of `lerobot-lint`."""
    from lerobot_lint import engine
    from lerobot_lint.config import load_profile

    names = json.loads((log / "meta/info.json").read_text())["features"]["action"]["names"]
    engine.iter_episodes = lambda *_, **__: episodes(log)
    findings = engine.check_dataset(str(log), load_profile("default"))
    found: list[dict[str, Any]] = []
    for one in findings:
        if one.severity == "info" or one.check not in LINT:
            continue
        row: dict[str, Any] = {}
        if one.joint is not None:
            number = re.search(r"\d+", str(one.joint))
            row["joint"] = (names[int(number[0])] if number else one.joint).removesuffix(".pos")
        if one.episode is not None:
            row["episode"] = one.episode
        if one.frames:
            row["rows"] = [int(one.frames[0]), int(one.frames[-1])]
        found += [row | {"kind": kind} for kind in LINT[one.check]]
    return found


def episodes(log: Path) -> Iterator[tuple[int, Any, None]]:
    """Read episodes as `lerobot-lint` has them."""
    from lerobot_lint.types import EpisodeData

    table = parquet.read_table(log / "data/chunk-000/file-000.parquet").to_pydict()
    of = np.array(table["episode_index"])
    for number in range(of.max() + 1):
        rows = of == number
        whole = EpisodeData(
            states=np.array(table["observation.state"], dtype=np.float32)[rows],
            actions=np.array(table["action"], dtype=np.float32)[rows],
            timestamps=np.array(table["timestamp"], dtype=np.float64)[rows],
            fps=30.0,
            task="pick",
            camera_handles={},
        )
        yield number, whole, None


if __name__ == "__main__":
    main()
