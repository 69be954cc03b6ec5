"""Dated logs of the same joints: the stretch of each day that tells most of a joint."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.frozen_checks import frozen_rows
from tendon_newton.data.importers.joint_examination import motion_of
from tendon_newton.data.importers.joint_faults import MOTION_LIMIT
from tendon_newton.data.oscillations.log_reading import ReadLog
from tendon_newton.data.oscillations.shaking import SHORTEST, Evenly, evenly, uninterrupted
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording

DATE = re.compile(r"(?<!\d)(20\d\d)[-_]?([01]\d)[-_]?([0-3]\d)(?!\d)")
LONGEST = 15.0  # Stretch that is fitted of a joint and day [s]
STRETCHES = 3  # That make up the longest where each is short


@dataclass(frozen=True, kw_only=True)
class Day:
    """Recordings of one day."""

    name: str  # Date, or the log's name where it has none
    day: float  # Since an origin [days]; the place in the order where there are no dates
    recordings: tuple[Recording, ...]


def dated(logs: Mapping[str, ReadLog]) -> list[Day]:
    """Sort the recordings of logs by the dates in their names, else by the order of the logs.

    Args:
        logs: Logs by their path or id, each of the same joints.

    Raises:
        InvalidRecording: Their joints differ, some have dates and others not, or all are of a day.
    """
    joints = {log.joints for log in logs.values()}
    if len(joints) > 1:
        told = ", ".join(f"{name}: {' '.join(log.joints)}" for name, log in logs.items())
        raise InvalidRecording(f"logs of the same joints are needed; these differ: {told}")
    found: dict[tuple[float, str], list[Recording]] = {}
    undated: list[str] = []
    for place, (name, log) in enumerate(logs.items()):
        for one in log.recordings:
            day = date_in(one.name) or date_in(name)
            key = (float(place), Path(name).name)
            if day is not None:
                key = (float(day.toordinal()), day.isoformat())
            else:
                undated.append(name)
            found.setdefault(key, []).append(one)
    if undated and len(set(undated)) < len(logs):
        raise InvalidRecording(
            f"{undated[0]}: no date in its name, others have one; name it as in run_2026-11-28.csv"
        )
    if len(found) == 1:
        raise InvalidRecording(
            f"{next(iter(logs))}: logs of several days are needed, this is one; name a log of "
            "each, or put dates into the names of the files, as in run_2026-11-28.csv"
        )
    return [
        Day(name=name, day=day, recordings=tuple(ones))
        for (day, name), ones in sorted(found.items(), key=lambda item: item[0])
    ]


def date_in(name: str) -> date | None:
    """Return the last date in a name; None where there is none."""
    for year, month, day in reversed(DATE.findall(name)):
        try:
            return date(int(year), int(month), int(day))
        except ValueError:
            continue
    return None


def stretches_of(day: Day, place: int) -> list[Evenly]:
    """Return what tells most of a joint on a day: where its command travels farthest.

    Nothing where it hardly moves.
    """
    found: list[tuple[float, Evenly]] = []
    for whole in day.recordings:
        motion = motion_of(whole, frozen_rows(whole), place)
        for rows in uninterrupted(motion.time):
            log = evenly(motion.time[rows], motion.command[rows], motion.position[rows])
            moved = np.r_[0.0, np.cumsum(np.abs(np.diff(log.command)))]
            count = min(round(LONGEST / log.step), len(moved) - 1)
            first = int(np.argmax(moved[count:] - moved[: len(moved) - count]))
            part = slice(first, first + count)
            if np.ptp(log.command[part]) > MOTION_LIMIT:
                cut = Evenly(step=log.step, command=log.command[part], angle=log.angle[part])
                found.append((float(moved[first + count] - moved[first]), cut))
    chosen: list[Evenly] = []
    for _, log in sorted(found, key=lambda one: -one[0])[:STRETCHES]:
        if sum(len(one.angle) * one.step for one in chosen) < LONGEST - SHORTEST:
            chosen.append(log)
    return chosen
