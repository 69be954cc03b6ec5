"""Numbers that a fit could not pin down: said, not hidden."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tendon_newton.identification.linearisation import Linearisation, invertible

CONFOUNDED = 0.95  # Correlation from which two numbers are not told apart [1]
FLAT = 0.95
"""Share of a parameter's range that an interval covers if the data say nothing about it [1]."""


@dataclass(frozen=True, kw_only=True)
class Confounded:
    """Two numbers of which the data know a combination better than either."""

    first: str  # First number, as ``effect.parameter``
    second: str
    correlation: float
    """Correlation of their errors [1]; near 1 they grow at once, near -1 one replaces the other."""

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``."""
        return {"numbers": [self.first, self.second], "correlation": round(self.correlation, 4)}


def find_confounded(point: Linearisation, names: Sequence[str]) -> tuple[Confounded, ...]:
    """Return the pairs of numbers whose errors go together, the closest first.

    Args:
        point: A fit's residuals around its optimum.
        names: Names of its numbers, shape (F,).
    """
    if len(names) < 2:
        return ()
    covariance = np.linalg.inv(invertible(point.normal_matrix()))
    size = np.sqrt(np.maximum(np.diag(covariance), 1.0e-300))
    correlation = np.clip(covariance / np.outer(size, size), -1.0, 1.0)
    pairs = [
        Confounded(first=names[i], second=names[j], correlation=float(correlation[i, j]))
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(correlation[i, j]) > CONFOUNDED
    ]
    return tuple(sorted(pairs, key=lambda pair: -abs(pair.correlation)))


def is_flat(ci95: tuple[float, float], lower: float, upper: float) -> bool:
    """Tell whether an interval is as wide as the range that a parameter may have."""
    return ci95[1] - ci95[0] >= FLAT * (upper - lower)
