"""Where the search for a candidate's numbers starts."""

from __future__ import annotations

import itertools

import numpy as np

from tendon_newton.data.parameters import Parameter
from tendon_newton.data.recording import Array
from tendon_newton.identification.least_squares import Candidate

STARTS_AROUND = (0.7, 0.87, 1.15, 1.4)
"""Factors on a fitted value at which a finer search starts again.

The finer the scale, the narrower the valley.
"""
MOST_STARTS = 24
"""Starting points per candidate."""


def starting_grid(parameter: Parameter, value: float) -> list[float]:
    """Return values from which a search for one parameter starts, around its typical size."""
    if parameter.null == 1.0:
        grid = [0.5, 0.7, 0.85, 1.15, 1.4, 2.0, 3.0]
    else:
        typical = abs(parameter.nominal) or 0.1 * parameter.upper
        sizes = [typical * factor for factor in (0.1, 0.3, 1.0, 3.0)]
        grid = [*sizes, *(-s for s in sizes)] if parameter.lower < 0.0 else sizes
        grid += [value * factor for factor in (0.5, 1.5, 2.0, 3.0) if np.isfinite(value)]
    inside = [float(np.clip(x, parameter.lower, parameter.upper)) for x in grid]
    return (
        list(dict.fromkeys([*inside, value])) if np.isfinite(value) else list(dict.fromkeys(inside))
    )


def spread(points: list[tuple[float, ...]], most: int) -> list[tuple[float, ...]]:
    """Return points evenly spread over a list, at most so many."""
    places = np.linspace(0, len(points) - 1, min(most, len(points)))
    return [points[int(place)] for place in places]


def starts_around(candidate: Candidate, newest: int) -> Array:
    """Return a candidate's value, and values with one of its last numbers moved, shape (S, F)."""
    starts = [candidate.value]
    places = range(len(candidate.columns) - newest, len(candidate.columns))
    for f, factor in itertools.product(places, STARTS_AROUND):
        moved = candidate.value.copy()
        moved[f] = np.clip(moved[f] * factor, candidate.lower[f], candidate.upper[f])
        starts.append(moved)
    return np.array(starts)
