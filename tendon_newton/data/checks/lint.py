"""Defects of recorded data, found before any model is fitted to them.

Nothing is changed or worked around: a finding says what was seen and what follows.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tendon_newton.data.checks.column_checks import COLUMN_CHECKS, contradictions
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.lint_checks import CHECKS, CORRELATION_LIMIT, measured_channels
from tendon_newton.data.checks.register_checks import correlations
from tendon_newton.data.recording import Recording

__all__ = ["Finding", "lint_dataset", "lint_recording"]

WARMING_LIMIT = 3.0  # [K] one degree is the resolution; copper changes by 1.2 % in 3 K


def lint_recording(
    recording: Recording, limits: Mapping[str, float] | None = None
) -> tuple[Finding, ...]:
    """Run every check on one recording.

    Args:
        limits: Known limits by column [column's unit], to find rows at the limit.
    """
    findings = [finding for check in (*CHECKS, *COLUMN_CHECKS) for finding in check(recording)]
    return (*findings, *saturation(recording, limits or {}))


def lint_dataset(train: Sequence[Recording], test: Sequence[Recording]) -> tuple[Finding, ...]:
    """Look for what only shows between recordings."""
    every = (*train, *test)
    return (*copies(train, test), *contradictions(every), *warming(every))


def saturation(recording: Recording, limits: Mapping[str, float]) -> Iterator[Finding]:
    """Rows in which a channel sits at its known limit."""
    channels = dict(measured_channels(recording))
    for column, limit in limits.items():
        share = float((np.abs(channels[column]) >= limit).mean()) if column in channels else 0.0
        if share > 0.0:
            yield Examined(recording.name, column).note(
                f"{100.0 * share:.1f} % of the rows are at the limit of {limit:g}",
                "there the position loop does nothing; the model must limit too",
            )


def copies(train: Sequence[Recording], test: Sequence[Recording]) -> Iterator[Finding]:
    """Test recordings that are train recordings under another name."""
    for held in test:
        for seen in train:
            if np.array_equal(held.motor_position, seen.motor_position):
                yield Examined(held.name, "theta").defect(
                    f"equal to {seen.name} of the train split in every row",
                    "errors on it are not held out",
                )


def warming(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Temperature that goes with a setting, so that the two cannot be told apart."""
    warm = [recording for recording in recordings if recording.temperature is not None]
    keys = sorted({key for recording in warm for key in recording.actuator_overrides})
    for key in keys:
        groups: dict[float, list[float]] = {}
        for recording in warm:
            if key in recording.actuator_overrides and recording.temperature is not None:
                value = recording.actuator_overrides[key]
                groups.setdefault(value, []).append(float(recording.temperature.mean()))
        means = {value: float(np.mean(groups[value])) for value in sorted(groups)}
        rise = max(means.values()) - min(means.values())
        (trend,) = correlations(np.array(list(means)), np.array(list(means.values())))
        if rise > WARMING_LIMIT and abs(trend) > CORRELATION_LIMIT:
            listed = ", ".join(f"{mean:.1f} degC at {value:.3g}" for value, mean in means.items())
            yield Examined("all", "temperature").caution(
                f"goes with {key}: {listed}",
                f"an effect of temperature cannot be told from one of {key}",
            )
