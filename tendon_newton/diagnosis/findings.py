"""What a search hands to the diagnosis: causes, numbers, classes, and an account of every cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tendon_newton.diagnosis.result import CandidateScore, Criterion, Verdict
from tendon_newton.identification.linearisation import Linearisation


@dataclass(frozen=True, kw_only=True)
class Found:
    """A set of causes with all its numbers."""

    effects: tuple[str, ...]
    """Causes, those that explain most first; empty for the starting model."""
    values: Mapping[int, float]
    """Parameter column -> fitted value."""
    intervals: Mapping[int, tuple[float, float]]
    """Parameter column -> 95 % interval, given the causes."""
    point: Linearisation
    """Residuals around the optimum, one column of the Jacobian per value."""


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What a search found on the training recordings."""

    verdict: Verdict
    baseline: Found
    """The starting model with its unknown numbers refitted."""
    final: Found | None
    """All named causes together; None where none is named."""
    closest: Found
    """What came closest: the named causes, or what was found and may not be named."""
    classes: Mapping[str, tuple[tuple[str, Found], ...]]
    """For each cause the rivals that explain the data as well, each with its fit."""
    candidates: tuple[CandidateScore, ...]
    """Every effect tried, best first."""
    criteria: Mapping[str, tuple[Criterion, ...]] = field(default_factory=dict)
    """What each named cause had to pass."""
    probabilities: Mapping[str, float] = field(default_factory=dict)
    """Share of draws of blocks of time in which each named cause passes the bar."""
    finished: bool = True
    """Whether the search came to its end; else causes may be missing."""
    notes: tuple[str, ...] = ()
    """What the reader must know of the search."""
