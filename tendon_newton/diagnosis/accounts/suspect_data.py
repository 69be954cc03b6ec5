"""Recordings that contradict each other, the model's bench or its units, told before any cause."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.plain_numbers import quantity
from tendon_newton.data.recording import Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.diagnosis.accounts.wrong_scales import Suspect, wrong_scales, wrong_units
from tendon_newton.errors import TendonNewtonError
from tendon_newton.identification.study import Residual, Study, replacements

APART = 5.0
"""A recording whose error is so many times the median one of the others stands apart [1]."""
BETTER = 3.0  # Another bench fits a recording if it makes its error so many times smaller [1]
FEW_ROWS, NEARLY_ALL = 0.1, 0.9
"""An error comes at times if so few rows have so much of its square [1]."""
JUMP = 0.1  # Share of all its way that a command goes within a row at a jump [1]
ANSWERED = 0.5  # Time after a jump in which the slowest servo answers [s]
LEAST_RECORDINGS = 3  # Fewer have no majority
ALIKE = 1.0e-6  # Commands that differ by less are the same [rad]
CONTRADICTS = 10.0  # Noise floors by which equal runs differ that contradict each other [1]


def plainly_wrong(study: Study, model: Model) -> tuple[Suspect, ...]:
    """Look, before any cause is sought, for recordings that contradict units or each other."""
    base = study.residuals(*replacements([{}]))
    scales = tuple(wrong_scales(study, model, base))
    return (*(scales or wrong_units(study.recordings, base)), *contradictions(study))


def standing_apart(
    study: Study, model: Model, values: Mapping[int, float], benches: Sequence[str]
) -> tuple[Suspect, ...]:
    """Look for errors of single recordings or moments, where no cause explains them.

    Args:
        model: The model that was started from.
        values: Parameter column -> value of the model that came closest.
    """
    residuals = study.residuals(*replacements([values]))
    times = tuple(at_times(study, residuals))
    return times or tuple(strangers(study, model, values, residuals, benches))


def at_times(study: Study, residuals: Sequence[Residual]) -> Iterator[Suspect]:
    """Say when an error comes if few rows of the worst recording have nearly all of it."""
    worst = max(range(len(residuals)), key=lambda index: size_of(residuals[index], study))
    recording, residual = study.recordings[worst], residuals[worst]
    square = np.where(residual.trusted, residual.theta[0] ** 2, 0.0)
    ranked = np.sort(square)[::-1]
    first = float(ranked[: max(1, int(FEW_ROWS * len(ranked)))].sum())
    share = first / max(float(ranked.sum()), len(ranked) * study.noise.theta**2)
    if share < NEARLY_ALL:
        return
    row = int(np.argmax(square))
    worst_rows = np.argsort(square)[::-1][: max(1, int(FEW_ROWS * len(square)))]
    if square[worst_rows][after_jumps(recording)[worst_rows]].sum() > NEARLY_ALL * first:
        return  # what answers a step is missed, and nothing from outside
    yield Suspect(
        recording=recording.name,
        text=f"The error comes at times: in {recording.name}, {100.0 * FEW_ROWS:.0f} % of the rows "
        f"hold {100.0 * share:.0f} % of the squared error of the motor angle, most of it about "
        f"t = {recording.time[row]:.1f} s. A knock, a cable or something in the way does that.",
    )


def after_jumps(recording: Recording) -> Mask:
    """Tell which rows come soon after the first one or a jump of some command, shape (T,)."""
    if recording.command is None:
        return np.zeros(recording.sample_count, dtype=np.bool_)
    steps = np.abs(np.diff(recording.command, axis=0))
    jumps = np.flatnonzero((steps > JUMP * np.ptp(recording.command, axis=0)).any(axis=1)) + 1
    latest = np.full(recording.sample_count, -np.inf)
    latest[jumps] = recording.time[jumps]
    latest[0] = recording.time[0]  # what was commanded before is not known
    since = recording.time - np.maximum.accumulate(latest)
    return since < ANSWERED


def contradictions(study: Study) -> Iterator[Suspect]:
    """Find runs with the same command on the same bench that gave different motions, told once."""
    pairs: list[tuple[float, Recording, Recording]] = []
    views = zip(study.recordings, study.sources, strict=True)
    for (one, (_, servo)), (other, (_, another)) in combinations(views, 2):
        if servo == another and same_run(one, other):
            size = rms(one.motor_position[:, 0] - other.motor_position[:, 0])
            if size > CONTRADICTS * study.noise.theta:
                pairs.append((size, one, other))
    if pairs:
        size, one, other = max(pairs, key=lambda pair: pair[0])
        more = f" So do {len(pairs) - 1} other pairs, less." if len(pairs) > 1 else ""
        yield Suspect(
            recording=other.name,
            text=f"{one.name} and {other.name} have the same bench and the same commands, and "
            f"their motor angles differ by {quantity(size, 'rad')} (noise "
            f"{quantity(study.noise.theta, 'rad')}): they contradict each other.{more} "
            "Something changed between them that no file tells: a load, a spring, a supply. "
            "Leave one out.",
        )


def same_run(one: Recording, other: Recording) -> bool:
    """Tell whether two recordings had the same bench and the same commands."""
    if one.command is None or other.command is None or one.command.shape != other.command.shape:
        return False
    settings = [
        (r.bench, repr(r.bench_overrides), dict(r.actuator_overrides), r.start)
        for r in (one, other)
    ]
    return settings[0] == settings[1] and bool(np.allclose(one.command, other.command, atol=ALIKE))


def strangers(
    study: Study,
    model: Model,
    values: Mapping[int, float],
    residuals: Sequence[Residual],
    benches: Sequence[str],
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
        # one servo's signals are no recording of another bench
        others_of = [b for b in benches if b != recording.bench and study.servos == 1]
        fits = {b: size_on(b, study, model, values, recording) for b in others_of}
        bench = min(fits, key=lambda name: fits[name], default=None)
        if bench is not None and BETTER * fits[bench] < sizes[index]:
            text += (
                f"As a recording of {bench} it fits {sizes[index] / fits[bench]:.2g} times better, "
                f"and its entry in dataset.toml says {recording.bench}. Mend the entry and "
                "diagnose again."
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


def size_on(
    bench: str, study: Study, model: Model, values: Mapping[int, float], recording: Recording
) -> float:
    """Return a recording's error as a recording of another bench [1]; infinite if it is none."""
    try:
        moved = Study(
            [replace(recording, bench=bench)],
            model,
            study.table.effects,
            time_step=study.time_step,
            scale=study.scale,
        )
        moved.noise = study.noise
        of_causes = {c: v for c, v in values.items() if c not in study.tolerated_columns}
        owners = [study.table.owners[column] for column in of_causes]
        own = {
            moved.table.column(owner, p.name): v
            for (owner, p), v in zip(owners, of_causes.values(), strict=True)
        }
    except TendonNewtonError:  # what the entry states of its bench does not suit another
        return float("inf")
    return size_of(moved.residuals(*replacements([own]))[0], moved)
