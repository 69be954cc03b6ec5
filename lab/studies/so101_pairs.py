"""Real SO-101 logs: pairs of training motions of a joint, and a model of it that chooses nothing.

Rows in which something solid holds the shaft tell of no servo and do not count. The logs are
isaac-sim2real/sage's; they are not part of this repository.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.identification.study import Study, replacements

FIXED = ("actuator_lag", "command_delay", "deadband", "position_offset")
"""What anyone would fit who does not choose."""
TOLD = Model(actuator=NamedValues(name="ideal_position", values={}))
"""A servo that is where it was told to be."""
MOVED = 0.02  # A joint whose command spans less in a motion [rad] only holds still there
SEED = 0  # Seed of the draw of pairs


def joints(imported: Imported) -> list[str]:
    """Return the names of the joints, in their order."""
    return list(dict.fromkeys(str(log.conditions["joint"]) for log in imported.logs))


def split(folder: Path, logs: list[ImportedLog], train: tuple[str, ...]) -> Dataset:
    """Train on some motions, test on all others."""
    seen = tuple(log.recording for log in logs if log.conditions["motion"] in train)
    held = tuple(log.recording for log in logs if log.conditions["motion"] not in train)
    return Dataset(path=folder, train=seen, test=held)


def drawn(pairs: list[tuple[str, str]], count: int) -> list[tuple[str, str]]:
    """Return some of the pairs, drawn by a fixed seed, or all."""
    if count >= len(pairs):
        return pairs
    chosen = np.random.default_rng(SEED).choice(len(pairs), count, replace=False)
    return [pairs[i] for i in sorted(chosen)]


def moving(logs: list[ImportedLog]) -> list[str]:
    """Return the motions in which a joint is told to move."""
    commands = {str(log.conditions["motion"]): log.recording.command for log in logs}
    return [
        motion
        for motion, command in commands.items()
        if command is not None and np.ptp(command) > MOVED
    ]


def fixed_fit(model: Model, train: Study) -> dict[int, float]:
    """Fit the model that chooses nothing to the training motions (column -> value)."""
    worlds = SearchWorlds(train)
    found = fit_set_anew(worlds, model, FIXED)
    return values_of(worlds, found.columns, found.place)


def squares(test: Study, models: Sequence[dict[int, float]]) -> list[list[Array]]:
    """Return squared errors [rad^2] by model and held-out motion, where the shaft is free."""
    residuals = test.residuals(*replacements(models))
    return [[r.theta[m, r.trusted] ** 2 for r in residuals] for m in range(len(models))]


def pooled_rms(squares: list[Array]) -> float:
    """Return the RMS error over all rows of all motions [rad]."""
    return float(np.sqrt(np.concatenate(squares).mean()))


def causes(diagnosis: Diagnosis) -> str:
    """Return the named causes in words."""
    return ", ".join(
        " ".join([effect.name, *(f"{e.value:.3g} {e.unit}" for e in effect.parameters.values())])
        for effect in diagnosis.effects
    )
