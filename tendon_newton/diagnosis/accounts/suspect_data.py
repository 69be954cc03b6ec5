"""Recordings that contradict each other, the model's bench or its units, told before any cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import TendonNewtonError
from tendon_newton.identification.study import Residual, Study, replacements

APART = 5.0
"""A recording whose error is so many times the median one of the others stands apart [1]."""
BETTER = 3.0
"""Another bench fits a recording if it makes its error so many times smaller [1]."""
LEAST_RECORDINGS = 3
"""Fewer have no majority."""
ALIKE = 1.0e-6
"""Commands that differ by less are the same [rad]."""
CONTRADICTS = 10.0
"""Noise floors by which equal runs differ that contradict each other [1]."""
UNITS: dict[str, tuple[tuple[float, str], ...]] = {
    "theta": ((57.3, "degrees in place of rad"), (1e3, "mrad in place of rad"),
              (1.0 / 57.3, "turned from degrees to rad twice")),
    "force": ((1e3, "mN in place of N"), (1e-3, "kN in place of N"),
              (0.102, "kgf in place of N"), (102.0, "gf in place of N"),
              (0.2248, "lbf in place of N")),
}  # fmt: skip
"""Signal -> measured over true value, and what was then taken for what."""
NEAR_UNIT = 0.15
"""How near a ratio must be to one of a unit, as a share of it [1]."""
FOLLOWS = 0.9
"""Correlation of measured and simulated from which their ratio means a unit [1]."""


@dataclass(frozen=True, kw_only=True)
class Suspect:
    """Something about the data that no cause should be made of."""

    recording: str
    text: str
    """What was seen and what follows, in sentences."""


def suspects(study: Study, model: Model, values: Mapping[int, float]) -> tuple[Suspect, ...]:
    """Look for recordings that the others or the model's units contradict.

    Args:
        study: Training recordings.
        model: The model that was started from.
        values: Parameter column -> value of the model that came closest.
    """
    base, residuals = study.residuals(*replacements([{}])), study.residuals(*replacements([values]))
    found = [*wrong_units(study.recordings, base), *contradictions(study)]
    return (*found, *strangers(study, model, values, residuals))


def wrong_units(recordings: Sequence[Recording], base: Sequence[Residual]) -> Iterator[Suspect]:
    """Find signals that follow the simulated one in another unit."""
    for recording, residual in zip(recordings, base, strict=True):
        pairs = [("theta", recording.motor_position[:, 0], residual.theta[0])]
        if recording.force is not None and residual.force is not None:
            pairs.append(("force", recording.force[:, 0], residual.force[0]))
        for signal, measured, missed in pairs:
            ratio = ratio_of(measured[residual.trusted], (measured - missed)[residual.trusted])
            for unit, words in UNITS[signal]:
                if ratio is not None and abs(ratio / unit - 1.0) < NEAR_UNIT:
                    yield Suspect(
                        recording=recording.name,
                        text=f"{recording.name}: {signal} is {ratio:.3g} times what the model "
                        f"gives and follows it otherwise: {words}? Mend the unit and diagnose "
                        "again; no cause should be made of this.",
                    )


def ratio_of(measured: Array, simulated: Array) -> float | None:
    """Return by what a signal must be multiplied to give another that follows it; else None."""
    a, b = measured - measured.mean(), simulated - simulated.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b / (b @ b)) if size > 0.0 and abs(float(a @ b)) > FOLLOWS * size else None


def contradictions(study: Study) -> Iterator[Suspect]:
    """Find runs with the same command on the same bench that gave different motions."""
    for one, other in combinations(study.recordings, 2):
        if not same_run(one, other):
            continue
        apart = one.motor_position[:, 0] - other.motor_position[:, 0]
        size = float(np.sqrt(np.mean(apart**2)))
        if size > CONTRADICTS * study.noise.theta:
            yield Suspect(
                recording=other.name,
                text=f"{one.name} and {other.name} have the same bench and the same commands, and "
                f"their motor angles differ by {1e3 * size:.3g} mrad (noise "
                f"{1e3 * study.noise.theta:.2g}): they contradict each other. Something changed "
                "between them that no file tells: a load, a spring, a supply. Leave one out.",
            )


def same_run(one: Recording, other: Recording) -> bool:
    """Tell whether two recordings had the same bench and the same commands."""
    if one.command is None or other.command is None or one.command.shape != other.command.shape:
        return False
    settings = [(r.bench, repr(r.bench_overrides), dict(r.actuator_overrides), r.start)
                for r in (one, other)]  # fmt: skip
    return settings[0] == settings[1] and bool(np.allclose(one.command, other.command, atol=ALIKE))


def strangers(
    study: Study, model: Model, values: Mapping[int, float], residuals: Sequence[Residual]
) -> Iterator[Suspect]:
    """Find single recordings that stand apart, and look whether another bench fits them."""
    recordings, sizes = study.recordings, np.array([size_of(r, study) for r in residuals])
    if len(recordings) < LEAST_RECORDINGS:
        return
    for index, recording in enumerate(recordings):
        others = float(np.median(np.delete(sizes, index)))
        if sizes[index] < APART * max(others, 1.0):
            continue
        text = (
            f"{recording.name} stands apart: its error is {sizes[index] / max(others, 1.0):.2g} "
            "times that of the other recordings. "
        )
        bench = better_bench(study, model, values, recording, float(sizes[index]))
        if bench is not None:
            text += (
                f"As a recording of {bench} it fits: its entry in dataset.toml says "
                f"{recording.bench}. Mend the entry and diagnose again."
            )
        else:
            text += "Check its bench, its load and its zero, or diagnose without it."
        yield Suspect(recording=recording.name, text=text)


def size_of(residual: Residual, study: Study) -> float:
    """Return a recording's error in noise floors, both signals together [1]."""
    theta = residual.theta[0, residual.trusted] / study.noise.theta
    squares = [float(np.mean(theta**2))]
    if residual.force is not None and study.noise.force:
        force = residual.force[0, residual.trusted] / study.noise.force
        squares.append(float(np.mean(force**2)))
    return float(np.sqrt(np.mean(squares)))


def better_bench(
    study: Study, model: Model, values: Mapping[int, float], recording: Recording, size: float
) -> str | None:
    """Return another bench of the data that fits a recording clearly better; None without one."""
    benches = dict.fromkeys(r.bench for r in study.recordings if r.bench != recording.bench)
    found: dict[str, float] = {}
    for bench in benches:
        try:
            moved = Study([replace(recording, bench=bench)], model, study.table.effects,
                          time_step=study.time_step, scale=study.scale)  # fmt: skip
            moved.noise = study.noise
            owners = [study.table.owners[column] for column in values]
            own = {moved.table.column(owner, p.name): v
                   for (owner, p), v in zip(owners, values.values(), strict=True)}  # fmt: skip
        except TendonNewtonError:  # what the entry states of its bench does not suit another
            continue
        found[bench] = size_of(moved.residuals(*replacements([own]))[0], moved)
    best = min(found, key=lambda name: found[name], default=None)
    return best if best is not None and BETTER * found[best] < size else None
