"""Exam of `wear`: ``python -m lab.exams.wear.exam --seed 1 --out FILE``.

Servos of which one of four parts wears, and as many sound ones, each with a log a day for ten days
(`units`). After each day the logs so far are looked at. A worn part is told in time if it is the
first that is ever named, on a day on which its effect has not doubled.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lab.exams.one_by_one import main
from lab.exams.wear.units import DAYS, PARTS, Unit, drawn_units
from tendon_newton.data.recording import Recording
from tendon_newton.data.wear.day_fit import fit_days
from tendon_newton.data.wear.days import Day, stretches_of
from tendon_newton.data.wear.worn_parts import LEAST_DAYS, Trend, trends_of


def answer(unit: Unit) -> dict[str, Any]:
    """Return truth and answer of one servo: the first part that is named, and on which day."""
    fits = fit_days([stretches_of(day_of(unit, k), 0) for k in range(DAYS)])
    row: dict[str, Any] = {"part": unit.part, "doubled": unit.doubled, "told": None, "at": None}
    trends: list[Trend] = []
    for count in range(LEAST_DAYS, DAYS + 1):
        trends = trends_of(np.arange(float(count)), fits[:count])
        if trends[0].wears:
            at = float(unit.effect[count - 1])
            return row | {"told": trends[0].part, "day": count - 1, "at": at}
    return row | {"undecided": [one.part for one in trends if not one.told]}


def day_of(unit: Unit, k: int) -> Day:
    """Return the log of one day as a reader would."""
    command, angle = unit.command[k], unit.angle[k]
    recording = Recording(
        name=f"day_{k}.csv",
        bench="servo",
        time=unit.row * np.arange(len(command), dtype=np.float64),
        command=command[:, None],
        motor_position=angle[:, None],
        motor_velocity=np.gradient(angle, unit.row)[:, None],
    )
    return Day(name=str(k), day=float(k), recordings=(recording,))


def score(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the rates, with those of constant answers beside them."""
    worn = [row for row in rows if row["part"] in PARTS]
    sound = [row for row in rows if row["part"] not in PARTS]
    in_time = [row for row in worn if row["told"] == row["part"] and row["at"] < 2.0]
    of_part = {part: [row for row in worn if row["part"] == part] for part in PARTS}
    return {
        "named_in_time": [len(in_time), len(worn)],
        "named_at_all": [sum(row["told"] == row["part"] for row in worn), len(worn)],
        "in_time_by_part": {
            part: [sum(row in in_time for row in own), len(own)] for part, own in of_part.items()
        },
        "effect_when_named": float(np.median([row["at"] for row in in_time] or [np.nan])),
        "best_constant_part": [max(map(len, of_part.values())), len(worn)],
        "sound_and_silent": [sum(row["told"] is None for row in sound), len(sound)],
        "sound_of_a_constant_part": [0, len(sound)],
    }


if __name__ == "__main__":
    main(__doc__, (5, "servos of each part"), drawn_units, answer, score)
