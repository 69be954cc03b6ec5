"""Is what remains noise, or does structure remain that no effect explains?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.diagnosis.search import FORM_FORCE, FORM_THETA, Search, trimmed_size
from tendon_newton.effects import find_effect
from tendon_newton.identification.least_squares import Linearisation
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import Scales
from tendon_newton.recording import Array, Recording

KEPT = 0.98
"""Share of the rows that counts, the largest residuals left out: a row at a jump proves nothing."""
EXCESS = 1.35
"""A residual this many noise floors in size is more than noise."""
FORM_ALLOWANCE = 3.0
"""With dry friction in the model its form error may be this many times the typical one."""
WORTH_NAMING = 0.15
"""Correlation below which a signal is not said to bear on the remaining residual."""


def is_noise(
    search: Search,
    point: Linearisation,
    scales: Scales,
    noise: NoiseFloor,
    effects: Sequence[str],
) -> bool:
    """Tell whether a fit's residuals are within noise.

    Where the model has dry friction they may hold its form error besides.

    Args:
        search: Where the fit comes from.
        point: Its residuals.
        scales: Units of the residuals.
        noise: Noise of the sensors.
        effects: All effects in the model.
    """
    dry = any(find_effect(name).dry for name in effects)
    theta = trimmed_size(point.residual[~search.where.is_force], KEPT) * scales.theta
    force = point.residual[search.where.is_force]
    limit_theta = np.hypot(EXCESS * noise.theta, FORM_ALLOWANCE * FORM_THETA if dry else 0.0)
    limit_force = np.hypot(
        EXCESS * (noise.force or 0.0), FORM_ALLOWANCE * FORM_FORCE if dry else 0.0
    )
    return bool(
        theta <= limit_theta
        and (len(force) == 0 or trimmed_size(force, KEPT) * scales.force <= limit_force)
    )


def dependencies(search: Search, residual: Array) -> tuple[str, ...]:
    """Return the signals with which the remaining residual correlates, strongest first."""
    names = ("theta", "theta_dot", "theta_d", "force", "t", "temperature", "voltage")
    strength = dict.fromkeys(names, 0.0)
    total = 0
    for index, recording in enumerate(search.study.recordings):
        trusted = search.study.timeline(index).trusted
        for is_force in (False, True):
            rows = (search.where.recording == index) & (search.where.is_force == is_force)
            if not rows.any():
                continue
            total += int(rows.sum())
            for name in names:
                signal = signal_of(recording, name)
                if signal is not None and np.ptp(signal) > 0.0:
                    strength[name] += rows.sum() * correlation_ratio(
                        signal[trusted], residual[rows]
                    )
    scored = {name: value / max(1, total) for name, value in strength.items()}
    ranked = sorted(scored, key=lambda name: -scored[name])
    return tuple(name for name in ranked if scored[name] > WORTH_NAMING)


def signal_of(recording: Recording, name: str) -> Array | None:
    """Return one column of a recording by its name in a file, shape (T,)."""
    table = {
        "t": recording.time,
        "theta": recording.motor_position,
        "theta_dot": recording.motor_velocity,
        "theta_d": recording.command,
        "force": recording.force,
        "temperature": recording.temperature,
        "voltage": recording.voltage,
    }
    signal = table[name]
    return signal if signal is None or signal.ndim == 1 else signal[:, 0]


def correlation_ratio(signal: Array, residual: Array, bins: int = 12) -> float:
    """Return the share of a residual's variance that a signal decides, in bins of equal count."""
    edges = np.quantile(signal, np.linspace(0.0, 1.0, bins + 1)[1:-1])
    place = np.searchsorted(edges, signal)
    variance = float(np.var(residual))
    if variance == 0.0:
        return 0.0
    count = np.bincount(place, minlength=bins)
    means = np.bincount(place, residual, bins) / np.maximum(count, 1)
    between = float(np.sum(count * (means - residual.mean()) ** 2)) / len(residual)
    return max(0.0, between / variance - (bins - 1) / len(residual))
