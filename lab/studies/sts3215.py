"""Logs of a Feetech STS3215 on pendulums: how they are split, and how far repeats differ.

The logs are those of kscalelabs/sysid, named
``m<grams>_l<mm>_kp<gain>_<trajectory>_<repeat>.json``.
"""

from collections.abc import Callable, Sequence

import numpy as np

from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.recording import Array


def arm(log: ImportedLog) -> tuple[object, object]:
    """Return the mass [kg] and the arm [m] of a log."""
    return log.conditions["mass"], log.conditions["length"]


SPLITS: dict[str, Callable[[ImportedLog], bool]] = {
    "gains": lambda log: float(log.conditions["kp"]) in (8, 32),
    "arm": lambda log: arm(log) == (0.535, 0.1),
    "heavy": lambda log: arm(log) == (0.969, 0.15),
}
"""Which logs are fitted; all others are tested."""


def repeat_floor(logs: Sequence[ImportedLog]) -> float:
    """Return the mean absolute deviation [mrad] of repeats from their median, in the same time."""
    groups: dict[str, list[Array]] = {}
    for log in logs:
        time, angle = log.recording.time, log.recording.motor_position[:, 0]
        grid = time[0] + np.arange(590) / 100.0
        groups.setdefault(log.source.stem[:-2], []).append(np.interp(grid, time, angle))
    repeated = [np.stack(runs) for runs in groups.values() if len(runs) > 1]
    return 1e3 * float(np.mean([np.abs(r - np.median(r, axis=0)).mean() for r in repeated]))
