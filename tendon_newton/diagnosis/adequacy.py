"""Is what remains as small as noise and the form errors of simple laws?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.diagnosis.greedy import Fit, Search, form_scales, trimmed_size
from tendon_newton.effects import find_effect
from tendon_newton.identification.noise_floor import NoiseFloor

KEPT = 0.98
"""Share of the rows that counts, the largest residuals left out: a row at a jump proves nothing."""
EXCESS = 1.35
"""A residual this many noise floors in size is more than noise."""
FORM_ALLOWANCE = 3.0
"""With dry friction in the model its form error may be this many times the typical one."""
COUNT = 1.5e-3
"""Gap of the motor angle [rad] that a 12-bit encoder shows as one count, on a nominal spool."""


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """What a fit leaves, root mean square of the rows that count."""

    theta: float
    """[rad]"""
    force: float | None
    """[N]; None without a load cell."""


def residual_sizes(search: Search, fit: Fit) -> Sizes:
    """Return the size of a fit's residuals."""
    residual, is_force = fit.point.residual, search.where.is_force
    return Sizes(
        theta=trimmed_size(residual[~is_force], KEPT) * fit.scales.theta,
        force=trimmed_size(residual[is_force], KEPT) * fit.scales.force if is_force.any() else None,
    )


def is_noise(search: Search, fit: Fit, noise: NoiseFloor, known: Sequence[str]) -> bool:
    """Tell whether a fit's residuals are within noise.

    Where the model has dry friction they may hold its form error besides.

    Args:
        search: Where the fit comes from.
        fit: It.
        noise: Noise of the sensors.
        known: Effects that the starting model has.
    """
    dry = any(find_effect(name).dry for name in (*known, *fit.effects))
    scale = search.study.scale
    form = form_scales(scale)
    limit_theta = np.hypot(
        EXCESS * noise.theta, FORM_ALLOWANCE * form.theta if dry else COUNT * scale.turn
    )
    limit_force = np.hypot(
        EXCESS * (noise.force or 0.0), FORM_ALLOWANCE * form.force if dry else 0.0
    )
    left = residual_sizes(search, fit)
    return bool(left.theta <= limit_theta and (left.force is None or left.force <= limit_force))
