"""What a search hands to the diagnosis: causes, numbers, classes, and an account of every cause."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.posterior import OpenNumber, Posterior
from tendon_newton.diagnosis.result import CandidateScore, Criterion, Verdict
from tendon_newton.identification.linearisation import Linearisation


@dataclass(frozen=True, kw_only=True)
class Found:
    """A set of causes with all its numbers."""

    effects: tuple[str, ...]  # Causes, those that explain most first; empty for the starting model
    values: Mapping[int, float]  # Parameter column -> fitted value
    intervals: Mapping[int, tuple[float, float]]
    """Parameter column -> 95 % interval; of causes with what unnamed effects would do."""
    point: Linearisation  # Residuals around the optimum, one column of the Jacobian per value
    numbers: tuple[OpenNumber, ...]  # Where each value is in its coordinate, F of them
    covariance: Array  # Covariance of these coordinates, given the causes, shape (F, F)


@dataclass(frozen=True, kw_only=True)
class PlainModel:
    """A model that a reader would try first, beside the answer."""

    name: str  # What it is called
    effects: tuple[str, ...]
    values: Mapping[int, float]  # Parameter column -> fitted value
    held_out: float  # Negative log likelihood per row of parts that no number has seen [nat]


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What a search found on the training recordings."""

    verdict: Verdict
    nameless: Verdict = "unexplained"
    """What is said where no cause is named: whether the starting model leaves nothing by itself."""
    baseline: Found  # The starting model with its unknown numbers refitted
    final: Found | None  # All named causes together; None where none is named
    closest: Found  # What came closest: the named causes, or what was found and may not be named
    suspected: tuple[str, ...]
    """Final causes whose intervals do not leave out that there is nothing."""
    classes: Mapping[str, tuple[tuple[str, Found], ...]]
    """For each cause the rivals that explain the data as well, each with its fit."""
    candidates: tuple[CandidateScore, ...]  # Every effect tried, best first
    criteria: Mapping[str, tuple[Criterion, ...]] = field(default_factory=dict)
    """What each named cause had to pass."""
    probabilities: Mapping[str, float] = field(default_factory=dict)
    """Weight of all sets of causes that hold each found cause, or one of its class [1]."""
    posterior: Posterior = field(default_factory=Posterior)  # All sets of causes that have weight
    plain: tuple[PlainModel, ...] = ()
    """Plain models beside the answer, the best on unseen parts first."""
    predictor: Found | None = None
    """The set that predicts parts best that no number has seen, its causes deserved or not; None
    where it is the named one, or where nobody asked."""
    predicts: float | None = None
    """Score of the written model on such parts [nat per row]; None where nobody asked."""
    finished: bool = True  # Whether the search came to its end; else causes may be missing
    notes: tuple[str, ...] = ()  # What the reader must know of the search

    @property
    def written(self) -> Found:
        """What is written: what predicts best, else the named causes, else the start refitted."""
        return self.predictor or self.final or self.baseline
