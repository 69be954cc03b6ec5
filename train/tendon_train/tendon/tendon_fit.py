r"""How much a tendon gives and how loose it is, from where the tip was while a load cell pulled.

.. math:: r \theta = l(q) + s + F / k

``l`` is the length that the finger has taken of the string, by the joint angles that the tip tells.
Springs, weight, friction of joints and obstacles do not enter. What is left between spool and
finger is slack ``s`` and stretch. A policy feels its motor alone, so this is what stands between a
motor at the right angle and a tip at the right place.

Left out: friction of guides behind the load cell, and errors of arms and spool; of the latter the
two numbers take in what they can.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_newton.effects import find_effect
from tendon_train.tendon.taut_rows import TautRows, name_finger, pieces_of

EFFECT_NUMBERS = (("tendon_compliance", "stiffness"), ("tendon_slack", "length"))
"""Effects that say k and s in a model."""
UNITS = ("N/m", "m")
STIFFEST = 1.0e6  # Where stretch is no longer told from none [N/m]: 0.02 mm at the servo's 21 N
DRAWS = 400  # Draws of the bootstrap, each of pieces of recordings
ROUNDS = 30  # Rounds of reweighting; the numbers stand still after five
TAIL = 3.0
"""Errors beyond this many typical ones count little [1]: rows of a fast motion, in which the
reading of a slow load cell is late."""


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A number and where it lies with 95 %."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class TendonFit:
    """Give and slack between a spool and a finger, with errors."""

    bench: str
    stiffness: Interval  # k [N/m]
    slack: Interval  # s [m]
    rows: int  # With a taut tendon, that were fitted
    # What the given model's tendon leaves of `r theta - l` on train recordings, RMS [m]
    unseen_before: float
    # What is left there, each part of the recordings under the numbers of all others, RMS [m]
    unseen_after: float
    held_out: bool  # Whether the errors below are of test recordings, and not of the fitted ones
    # What the given model's tendon leaves of `r theta - l`, RMS [m]; only reported
    error_before: float
    error_after: float  # What is left with the numbers found, RMS [m]; only reported

    @property
    def helps(self) -> bool:
        """Whether a model with it is nearer to train recordings that the fit did not see."""
        return self.unseen_after < self.unseen_before

    def to_json(self) -> dict[str, Any]:
        """Return the numbers by name; units as in the attributes."""
        return {"schema": 1, **asdict(self)}


def fit_tendon(dataset: Dataset, model: Model) -> tuple[TendonFit, Model]:
    """Find give and slack of the tendon of a dataset's finger.

    Args:
        dataset: Recordings of one finger with tip and force among others, which are left out.

    Returns:
        What was found, and the model with it; as it was, where the error of train recordings does
        not fall that the fit did not see. Test recordings only report.

    Raises:
        InvalidDataset: No recording shows a tip while a load cell pulls, or those of two fingers
            do, or it is no finger whose tip tells its joints.
    """
    finger = name_finger(dataset.train)
    by_recording = [own for r in dataset.train if (own := pieces_of([r], finger, model))]
    train = [piece for own in by_recording for piece in own]
    numbers, intervals = line_through(train)
    stiffness, slack = (
        Interval(value=value, low=low, high=high, unit=unit)
        for value, (low, high), unit in zip(numbers, intervals, UNITS, strict=True)
    )
    extended = with_tendon(model, (stiffness.value, slack.value))
    parts = by_recording if len(by_recording) > 1 else [[piece] for piece in train]
    test = pieces_of(dataset.test, finger, model)
    before, after = (surplus_error(test or train, m) for m in (model, extended))
    fit = TendonFit(
        bench=finger,
        stiffness=stiffness,
        slack=slack,
        rows=sum(p.force.size for p in train),
        unseen_before=surplus_error(train, model),
        unseen_after=unseen_error(parts, model),
        held_out=bool(test),
        error_before=before,
        error_after=after,
    )
    return fit, extended if fit.helps else model


def line_through(pieces: Sequence[TautRows]) -> tuple[Array, Array]:
    """Return stiffness [N/m] and slack [m], shape (2,), and their 95 % intervals, shape (2, 2)."""
    weights = robust_weights(pieces)
    sums = np.array([sums_of(piece, w) for piece, w in zip(pieces, weights, strict=True)])
    drawn = np.random.default_rng(0).integers(len(sums), size=(DRAWS, len(sums)))
    many = np.array([as_effects(*solve(sums[places].sum(axis=0))) for places in drawn])
    return (
        np.array(as_effects(*solve(sums.sum(axis=0)))),
        np.percentile(many, [2.5, 97.5], axis=0).T,
    )


def robust_weights(pieces: Sequence[TautRows]) -> list[Array]:
    """Return how much each row counts, by how far it is off the line through all."""
    every = TautRows(
        force=np.concatenate([piece.force for piece in pieces]),
        surplus=np.concatenate([piece.surplus for piece in pieces]),
    )
    weight = np.ones(every.force.size)
    for _ in range(ROUNDS):
        compliance, slack = solve(sums_of(every, weight))
        off = every.surplus - slack - compliance * every.force
        typical = max(1.48 * float(np.median(np.abs(off))), 1.0e-7)
        weight = 1.0 / (1.0 + (off / (TAIL * typical)) ** 2)
    return np.split(weight, np.cumsum([piece.force.size for piece in pieces])[:-1])


def sums_of(rows: TautRows, weight: Array) -> Array:
    """Return the sums that a line through rows needs, shape (5,)."""
    f, y = rows.force, rows.surplus
    return np.array([weight.sum(), weight @ f, weight @ f**2, weight @ y, weight @ (f * y)])


def solve(sums: Array) -> tuple[float, float]:
    """Return compliance [m/N] and slack [m] of the line through rows, neither below zero."""
    count, f, ff, y, fy = map(float, sums)
    spread = count * ff - f * f
    slope = (count * fy - f * y) / spread if spread > 1.0e-9 * count * ff else 0.0
    offset = (y - slope * f) / count
    if offset < 0.0:
        slope, offset = fy / ff, 0.0
    if slope <= 0.0:
        slope, offset = 0.0, max(0.0, y / count)
    return slope, offset


def as_effects(compliance: float, slack: float) -> tuple[float, float]:
    """Return stiffness [N/m] and slack [m] within what their effects allow."""
    values = (1.0 / max(compliance, 1.0 / STIFFEST), slack)
    bounds = [
        next(p for p in find_effect(effect).parameters if p.name == name)
        for effect, name in EFFECT_NUMBERS
    ]
    stiffness, length = (
        min(max(value, known.lower), known.upper)
        for value, known in zip(values, bounds, strict=True)
    )
    return stiffness, length


def with_tendon(model: Model, numbers: tuple[float, float]) -> Model:
    """Return a model with a tendon of this stiffness [N/m] and slack [m] in place of its own."""
    ours = tuple(
        NamedValues(name=effect, values={name: value})
        for (effect, name), value in zip(EFFECT_NUMBERS, numbers, strict=True)
    )
    replaced = {effect.name for effect in ours}
    return replace(model, effects=(*(e for e in model.effects if e.name not in replaced), *ours))


def unseen_error(parts: Sequence[list[TautRows]], model: Model) -> float:
    """Return what is left of what was wound in where no fit has looked, RMS [m].

    Args:
        parts: Pieces of each recording, or of one recording each piece; each part is measured with
            the numbers that all others give. One part alone is measured with its own.
        model: Whose tendon the numbers take the place of.
    """
    squares, rows = 0.0, 0
    for place, own in enumerate(parts):
        others = [piece for part in (*parts[:place], *parts[place + 1 :]) for piece in part]
        fitted = others or own
        weights = robust_weights(fitted)
        sums = sum(sums_of(piece, w) for piece, w in zip(fitted, weights, strict=True))
        count = sum(piece.force.size for piece in own)
        moved = with_tendon(model, as_effects(*solve(np.asarray(sums))))
        squares += count * surplus_error(own, moved) ** 2
        rows += count
    return float(np.sqrt(squares / rows))


def surplus_error(pieces: Sequence[TautRows], model: Model) -> float:
    """Return what a model's tendon leaves of what was wound in, RMS [m]."""
    own = {effect.name: effect.values for effect in model.effects}
    compliance = 1.0 / float(own.get("tendon_compliance", {}).get("stiffness", np.inf))
    slack = float(own.get("tendon_slack", {}).get("length", 0.0))
    off = np.concatenate([piece.surplus - slack - compliance * piece.force for piece in pieces])
    return rms(off)
