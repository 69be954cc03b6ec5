"""The logs of the comparison, and how they are split: conditions are left out whole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from lab.studies.comparison.table import ARM
from lab.studies.so101_pairs import drawn, joints, moving
from lab.studies.sts3215 import SPLITS, repeat_floor
from tendon_lab.foreign_logs.bam import read_bam
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model

GAINS, KEPT_BACK = (100, 200, 800), 400
"""Gains of the XL330's logs; those of the last came when the programs were there."""
DRAWN = 3  # Pairs of training motions of each joint of the arm
REPEAT = "1"  # Repeat of each STS3215 motion that is fitted and tested; the others tell the floor


@dataclass(frozen=True, kw_only=True)
class Split:
    """Logs of one servo, to fit and to test."""

    servo: str  # Name of the servo in Rhoban/bam, or `ARM`
    name: str
    train: tuple[ImportedLog, ...]
    test: tuple[ImportedLog, ...]
    start: Model  # Data sheet of the servo, with what its firmware does
    floor: float | None  # Mean absolute deviation of repeats [mrad], where there are repeats

    @property
    def key(self) -> str:
        """Return what the results are kept under."""
        return f"{self.servo}: {self.name}"


def splits_of(xl330: Path | None, sts3215: Path | None, so101: Path | None) -> list[Split]:
    """Return the splits of the logs that are there."""
    return [
        *([] if xl330 is None else xl330_splits(xl330)),
        *([] if sts3215 is None else sts3215_splits(sts3215)),
        *([] if so101 is None else so101_splits(so101)),
    ]


def xl330_splits(folder: Path) -> list[Split]:
    """Return each gain left out in turn, and each two; the last is fitted in pairs alone."""
    imported = read_bam(folder)
    lone = [((gain,), {*GAINS, gain}) for gain in (*GAINS, KEPT_BACK)]
    pairs = [(pair, {*GAINS, KEPT_BACK}) for pair in combinations((*GAINS, KEPT_BACK), 2)]
    return [
        split_by(
            "xl330",
            f"test kp {' and '.join(map(str, held))}",
            [log for log in imported.logs if log.conditions["kp"] in used],
            lambda log, held=held: log.conditions["kp"] not in held,
            imported.start_model,
            None,
        )
        for held, used in (*lone, *pairs)
    ]


def so101_splits(folder: Path) -> list[Split]:
    """Return pairs of motions of each joint that are fitted; all others are tested."""
    imported = read_so101(folder)
    out = []
    for joint in joints(imported):
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        out += [
            split_by(
                ARM,
                f"{joint} by {' and '.join(pair)}",
                logs,
                lambda log, pair=pair: log.conditions["motion"] in pair,
                imported.start_model,
                None,
            )
            for pair in drawn(list(combinations(moving(logs), 2)), DRAWN)
        ]
    return out


def sts3215_splits(folder: Path) -> list[Split]:
    """Return gains and arms left out."""
    imported = read_bam(folder)
    used = [log for log in imported.logs if log.source.stem[-1] == REPEAT]
    floor = repeat_floor(imported.logs)
    return [
        split_by("sts3215", name, used, train, imported.start_model, floor)
        for name, train in SPLITS.items()
    ]


def split_by(
    servo: str,
    name: str,
    logs: Sequence[ImportedLog],
    train: Callable[[ImportedLog], bool],
    start_of: Callable[[Sequence[ImportedLog]], Model],
    floor: float | None,
) -> Split:
    """Split some logs; the data sheet's numbers are those of the training logs."""
    fitted = tuple(log for log in logs if train(log))
    return Split(
        servo=servo,
        name=name,
        train=fitted,
        test=tuple(log for log in logs if not train(log)),
        start=start_of(fitted),
        floor=floor,
    )
