"""The logs of the comparison, and how they are split: conditions are left out whole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from examples.studies.sts3215 import SPLITS, repeat_floor
from tendon_newton.data.importers.bam import read_bam
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model

PAIRS = (
    ("viscous_friction", "coulomb_friction"),
    ("viscous_friction", "load_dependent_friction"),
    ("viscous_friction", "gear_load_friction"),
    ("viscous_friction", "holding_friction"),
)
"""Models of two effects: viscous friction with each plain law of dry friction. The pair that fits
the training logs best is the one that is tested."""
GAINS, KEPT_BACK = (100, 200, 800), 400
"""Gains of the XL330's logs; those of the last came when the programs were there."""
REPEAT = "1"
"""Repeat of each STS3215 motion that is fitted and tested; the others tell the floor."""


@dataclass(frozen=True, kw_only=True)
class Split:
    """Logs of one servo, to fit and to test."""

    servo: str
    """Name of the servo in Rhoban/bam."""
    name: str
    train: tuple[ImportedLog, ...]
    test: tuple[ImportedLog, ...]
    start: Model
    """Data sheet of the servo, with what its firmware does."""
    floor: float | None
    """Mean absolute deviation of repeats [mrad], where there are repeats."""

    @property
    def key(self) -> str:
        """Return what the results are kept under."""
        return f"{self.servo}: {self.name}"


def splits_of(xl330: Path | None, sts3215: Path | None) -> list[Split]:
    """Return the splits of the logs that are there."""
    return [
        *([] if xl330 is None else xl330_splits(xl330)),
        *([] if sts3215 is None else sts3215_splits(sts3215)),
    ]


def xl330_splits(folder: Path) -> list[Split]:
    """Return each gain left out in turn; the one that was kept back is never fitted."""
    imported = read_bam(folder)
    return [
        split_by(
            "xl330",
            f"test kp {gain}",
            [log for log in imported.logs if log.conditions["kp"] in {*GAINS, gain}],
            lambda log, gain=gain: log.conditions["kp"] != gain,
            imported.start_model,
            None,
        )
        for gain in (*GAINS, KEPT_BACK)
    ]


def sts3215_splits(folder: Path) -> list[Split]:
    """Return gains and arms left out."""
    imported = read_bam(folder)
    used = [log for log in imported.logs if log.source.stem[-1] == REPEAT]
    floor = repeat_floor(imported.logs)
    return [
        split_by(
            "sts3215",
            name,
            used,
            split.train,
            imported.start_model,
            floor,
        )
        for name, split in SPLITS.items()
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
