"""Say from a log whether a joint shakes, at what frequency, what makes it, what to change first.

LOG has commands and measured angles; nothing need be known of the bench. A LeRobotDataset (folder
or id of Hugging Face's Hub), a dataset or log of ours (.csv, .mcap, a ROS 2 bag) are read as they
are. Any other is read with --mapping, a file of five lines that names its columns:

    bench = "servo"
    [columns]
    t = {column = "time_s"}
    theta_d = {column = "goal_deg", unit = "deg"}
    theta = {column = "pos_deg", unit = "deg"}

First a table says how each joint follows its command, with what is wrong with the log. Of a joint
that shakes the loop is identified and asked what would calm it: less gain, delay, play, or no
integral under sticking. The exit code is 0 where all is calm, and 1 where a joint shakes.

    tendon-newton oscillation run.csv
    tendon-newton oscillation lerobot/svla_so101_pickplace --json
    tendon-newton oscillation logs --mapping mapping.toml
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from tendon_newton.cli.bench.examined_data import show_kinds
from tendon_newton.cli.terminal import VERDICT_COLOURS, coloured

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tendon_newton.data.checks.finding import Finding
    from tendon_newton.data.oscillations.log_reading import ReadLog
    from tendon_newton.data.oscillations.log_told import JointOfLog

EXIT_SHAKES = 1
ROUGH = 0.15  # Share of its motion that a joint's numbers leave, above which they are rough [1]


@dataclass(frozen=True, kw_only=True)
class LogReading:
    """How a log is read that says nothing of its bench."""

    mapping: Path | None = None
    """File that says which of the log's columns or topics, in which unit, is which of ours
    (docs/recordings_mapping.md); for a folder it names the files too."""
    unit: str | None = None
    """For a LeRobotDataset: what its joints are in, rad, deg or percent."""
    calibration: Path | None = None
    """For a LeRobotDataset: the arm's calibration file, which says what 100 percent are."""

    def read(self, log: str) -> ReadLog:
        """Read a log, by its path or its id on the Hub."""
        from tendon_newton.data.importers.lerobot import LeRobotUnits
        from tendon_newton.data.oscillations.log_reading import read_any_log

        units = LeRobotUnits(unit=self.unit, calibration=self.calibration)
        return read_any_log(log, self.mapping, units)


@dataclass(frozen=True, kw_only=True)
class Oscillation(LogReading):
    """The log, and how it is read and told."""

    log: tyro.conf.Positional[str]
    """Log (.csv, .mcap, .db3), folder of a bag or dataset, or id of a LeRobotDataset."""
    json: bool = False  # Print findings and numbers for programs and nothing else.


def main(config: Oscillation) -> None:
    """Read, tell, print, and leave with code 1 where a joint shakes."""
    from tendon_newton.data.oscillations.log_told import tell_log

    log = config.read(config.log)
    joints = list(tell_log(log))
    if config.json:
        print(json.dumps(table_of(log, joints), indent=1))
    else:
        show(log, joints)
    if any(one.told is not None for one in joints):
        raise SystemExit(EXIT_SHAKES)


def show(log: ReadLog, joints: Sequence[JointOfLog]) -> None:
    """Print what is wrong with the log, how its joints follow, and why they shake."""
    from tendon_newton.data.importers.joint_examination import HEADINGS
    from tendon_newton.data.oscillations.log_told import shaking_lines, supply_text

    width = max(len("joint"), *(len(one.joint) for one in joints))
    print(f"       {'joint':{width}}  {HEADINGS}  at limit")
    for one in joints:
        word, like = ("calm", "good") if one.told is None else ("shakes", "fix")
        print(
            f"{coloured(f'{word:6}', VERDICT_COLOURS[like])} {one.joint:{width}}  "
            f"{one.followed.text}  {100.0 * one.at_limit:6.1f} %"
        )
        following = one.followed.following
        if following is not None and following.residual > ROUGH * following.motion:
            print(
                f"      {'':{width}}  -> delay, lag and play leave {following.residual:.2f} of "
                f"{following.motion:.2f} rad RMS: they are rough; "
                "a load, a limit or a shaking moves it too"
            )
        show_kinds(one.findings, width)
    show_kinds(log.findings_of(None), width)
    if supply := supply_text(log.recordings):
        print(supply)
    wrong = any(one.severity == "defect" for one in findings_beside(log, joints))
    for one in joints:
        print(*shaking_lines(one), sep="\n", end="\n" if one.told is not None else "")
    count = sum(one.told is not None for one in joints)
    print(f"{count or 'none'} of {len(joints)} joints shake{'; mend the log first' * wrong}")


def findings_beside(log: ReadLog, joints: Sequence[JointOfLog]) -> list[Finding]:
    """Return what was found in all columns, less what a shaking explains."""
    return [*(one for joint in joints for one in joint.findings), *log.findings_of(None)]


def table_of(log: ReadLog, joints: Sequence[JointOfLog]) -> dict[str, Any]:
    """Return everything for programs; angles in rad, times in s."""
    return {
        "schema": 1,
        "findings": [asdict(one) for one in findings_beside(log, joints)],
        "joints": [joint_table(one) for one in joints],
    }


def joint_table(seen: JointOfLog) -> dict[str, Any]:
    """Return one joint for programs."""
    following = seen.followed.following
    table: dict[str, Any] = {
        "joint": seen.joint,
        "following": None if following is None else asdict(following),
        "at_limit": seen.at_limit,
        "shakes": None,
    }
    told = seen.told
    if told is None or told.shaking is None or told.explained is None or told.loop is None:
        return table
    from tendon_newton.data.oscillations.servo_loop import NAMES

    table["shakes"] = {
        "recordings": list(seen.shaken),
        "recording": seen.recording,
        "frequency": told.shaking.frequency,
        "amplitude": told.shaking.amplitude,
        "begin": told.log.start + told.log.step * told.shaking.first,
        "end": told.log.start + told.log.step * told.shaking.last,
        "above_floor": told.shaking.above_floor,
        "closed_by": "policy" if told.loop.feedback.outer else "servo",
        "policy": None if told.policy is None else asdict(told.policy),
        "servo": dict(zip(NAMES, map(float, told.loop.numbers), strict=True)),
        "told": None if told.fitted is None else told.fitted.told,
        "cause": told.explained.cause,
        "own_frequency": told.explained.own_frequency,
        "changes": [asdict(one) for one in told.explained.changes],
    }
    return table
