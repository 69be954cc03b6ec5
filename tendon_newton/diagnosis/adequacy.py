"""Is what remains as small as noise and the form errors of simple laws?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.diagnosis.search import FORM_FORCE, FORM_THETA, Search, trimmed_size
from tendon_newton.effects import find_effect
from tendon_newton.identification.least_squares import Linearisation
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import Scales

KEPT = 0.98
"""Share of the rows that counts, the largest residuals left out: a row at a jump proves nothing."""
EXCESS = 1.35
"""A residual this many noise floors in size is more than noise."""
FORM_ALLOWANCE = 3.0
"""With dry friction in the model its form error may be this many times the typical one."""
COUNT = 1.5e-3
"""Gap of the motor angle [rad] that a 12-bit encoder shows as one count."""


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """What a fit leaves, root mean square of the rows that count."""

    theta: float
    """[rad]"""
    force: float | None
    """[N]; None without a load cell."""


def residual_sizes(search: Search, point: Linearisation, scales: Scales) -> Sizes:
    """Return the size of a fit's residuals, which are in units of some scales."""
    force = point.residual[search.where.is_force]
    return Sizes(
        theta=trimmed_size(point.residual[~search.where.is_force], KEPT) * scales.theta,
        force=trimmed_size(force, KEPT) * scales.force if len(force) else None,
    )


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
    limit_theta = np.hypot(EXCESS * noise.theta, FORM_ALLOWANCE * FORM_THETA if dry else COUNT)
    limit_force = np.hypot(
        EXCESS * (noise.force or 0.0), FORM_ALLOWANCE * FORM_FORCE if dry else 0.0
    )
    left = residual_sizes(search, point, scales)
    return bool(left.theta <= limit_theta and (left.force is None or left.force <= limit_force))
