"""Say from logs of several days which part of a servo wears, and when it must be replaced.

LOGS are logs of the same joints with commands and measured angles, read as by `oscillation`: our
.csv, .mcap, bags and datasets, LeRobotDatasets, any other with --mapping. The date stands in the
name of a file or folder (run_2026-11-28.csv); without dates each log is a day, in the order given.
Each day gets delay, lag, friction, play and gain with intervals. Then the trends of gear play,
friction, string and motor gain are weighed against how days scatter. The exit code is 0 where
nothing is seen to wear, and 1 where a part wears.

    tendon-newton wear logs/run_*.csv
    tendon-newton wear me/pick_2026-11-01 me/pick_2026-11-08 me/pick_2026-11-15 me/pick_2026-11-22
    tendon-newton wear logs --mapping mapping.toml --json
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import tyro

from tendon_newton.cli.diagnosis.oscillation import LogReading
from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_newton.data.wear.passport import Passport

EXIT_WEARS = 1


@dataclass(frozen=True, kw_only=True)
class WearLogs(LogReading):
    """The logs, and how they are read."""

    logs: tyro.conf.Positional[tuple[str, ...]]
    """Logs (.csv, .mcap, .db3), folders of bags or datasets, or ids of LeRobotDatasets."""
    json: bool = False  # Print numbers and trends for programs and nothing else.


def main(config: WearLogs) -> None:
    """Read, fit, print, and leave with code 1 where a part wears."""
    from tendon_newton.data.wear.days import dated
    from tendon_newton.data.wear.passport import passport_lines, passport_of

    if not config.logs:
        raise InvalidParameter("LOGS must name logs of several days; none is named")
    logs = {name: config.read(name) for name in config.logs}
    days = dated(logs)
    seen: list[Passport] = []
    joints = next(iter(logs.values())).joints  # which all logs share
    for place, joint in enumerate(joints):
        seen.append(passport_of(joint, place, days))
        if not config.json:
            print(*passport_lines(seen[-1]), sep="\n", flush=True)
    if config.json:
        print(json.dumps({"schema": 1, "joints": [table_of(one) for one in seen]}, indent=1))
    if any(one.wears for one in seen):
        raise SystemExit(EXIT_WEARS)


def table_of(seen: Passport) -> dict[str, Any]:
    """Return one joint for programs; angles in rad, times in s, rates by day."""
    from tendon_newton.data.wear.passport import COLUMNS, number_of

    return {
        "joint": seen.joint,
        "verdict": seen.verdict,
        "days": [
            {
                "day": day.name,
                "told": fit.told,
                **{
                    name: None
                    if (found := number_of(fit, name)) is None
                    else {"value": found[0], "ci95": [found[0] - found[1], found[0] + found[1]]}
                    for name in COLUMNS
                },
            }
            for day, fit in zip(seen.days, seen.fits, strict=True)
        ],
        "not_told": list(seen.silent),
        "parts": [asdict(one) | {"told": one.told} for one in seen.trends],
    }
