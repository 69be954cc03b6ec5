"""What `tendon-newton doctor` finds in logs, in the benchmark's words."""

import re
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.importers.lerobot.lerobot_examination import examine_dataset
from tendon_newton.errors import TendonNewtonError

KINDS: tuple[tuple[str, str, str], ...] = (
    ("failed read", "", "failed_read"),
    ("repeated read", "", "repeated_read"),
    ("frozen read", "recorder stood still", "stalled_recorder"),
    ("frozen read", "", "frozen_read"),
    ("seam", "", "seam"),
    ("no command", "goes the other way", "reversed"),
    ("no command", "hold one goal", "lost_command"),
    ("no command", "it holds the", "relative_action"),
    ("no command", "has nothing to do", "wrong_command"),
    ("copied column", "", "copied_action"),
    ("exchanged joints", "", "exchanged_joints"),
    ("ahead", "", "late_command"),
    ("degrees", "", "scale"),
    ("", "the clock leaps", "clock_leap"),
    ("", "deg beside its command in", "calibration_jump"),
    ("", "deg beside its command", "offset"),
    ("", "ms late", "delay"),
    ("", "of play", "play"),
    ("", "is held short", "held"),
    ("", "rows are missing", "missing_rows"),
    ("", "rows are late", "late_rows"),
    ("", "out of order", "clock_disorder"),
    ("", "restart", "clock_disorder"),
    ("", "does not follow", "does_not_follow"),
)
"""Check of a finding, words in it, and the kind that it is; the first that fits."""
ROWS = re.compile(r"rows \((\d+)(?:-(\d+))?")
EPISODE = re.compile(r"episode_(\d+)")


def found_by_ours(folder: Path) -> dict[str, list[dict[str, Any]]]:
    """Examine every log of a folder."""
    logs = sorted(path for path in folder.iterdir() if path.is_dir())
    with ProcessPoolExecutor(2) as pool:
        return {log.name: own for log, own in zip(logs, pool.map(found_in, logs), strict=True)}


def found_in(log: Path) -> list[dict[str, Any]]:
    """Examine one log; one that is refused has one finding, without a joint."""
    try:
        seen = examine_dataset(log)
    except TendonNewtonError as error:
        return [{"kind": kind_of("", str(error))}]
    of_joints = [one for joint in seen.joints for one in told(joint.faults, joint.joint)]
    return [*of_joints, *told(seen.faults, None)]


def told(findings: Sequence[Finding], joint: str | None) -> Iterator[dict[str, Any]]:
    """Write findings of one joint, or of all."""
    for one in findings:
        row: dict[str, Any] = {"kind": kind_of(one.check, f"{one.evidence}; {one.consequence}")}
        if joint is not None and one.channel != "t":
            row["joint"] = joint.removesuffix(".pos")
        if episode := EPISODE.search(f"{one.recording} {one.evidence}"):
            row["episode"] = int(episode[1])
        if rows := ROWS.search(one.evidence):
            row["rows"] = [int(rows[1]), int(rows[2] or rows[1])]
        yield row


def kind_of(check: str, words: str) -> str:
    """Return the kind of a finding; its own words where none fits."""
    fitting = (kind for own, told, kind in KINDS if (not own or own == check) and told in words)
    return next(fitting, check or words[:40])
