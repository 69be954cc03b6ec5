"""A short formula for the remainder: few physical terms, kept only if they predict unseen data.

Terms are added one at a time (orthogonal matching pursuit) and dropped again where they are not
missed, as in sparse regression of equations. Source: Brunton, Proctor and Kutz, PNAS 113 (2016)
3932.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import atan2, hypot
from typing import Any

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array, Indices, Mask
from tendon_newton.diagnosis.unexplained.remainder import Remainder, Side, side_words

MOST_TERMS = 3  # Terms of a formula beside its constant
LEAST_STEP = 0.03  # Share of the variance that a term must explain to be kept
LEAST_R2 = 0.3  # Held-out share of the variance below which a formula is not offered
LEAST_OF_LEARNER = 0.6
"""Share of what the flexible learner reaches below which a formula is not offered."""
ANGLES = ("theta", "theta_d")  # Signals in which something may repeat itself
MOST_PER_RADIAN = 70.0
"""Fastest repetition that is looked for [1/rad]; a tooth of 5 degrees is slower."""
PERIODS_STEP = 0.15  # Periods over an angle's range by which the repetitions that are tried differ
STICK = 0.05  # Speed over which a direction is smoothed [rad/s]


@dataclass(frozen=True, kw_only=True)
class Term:
    """One term of a formula: a coefficient and a function of the signals."""

    function: str  # Function of the term in words: ``sign(theta_dot)``, ``sin(8.6 theta + 0.3)``
    coefficient: float  # [N or rad, per the function's unit]


@dataclass(frozen=True, kw_only=True)
class FoundEquation:
    """A sparse formula for the remainder."""

    side: Side
    terms: tuple[Term, ...]  # The constant first, then the strongest
    held_out_r2: float
    """Share of the variance predicted on recordings that neither terms nor numbers have seen."""
    scale: BenchScale = field(default_factory=BenchScale)  # Scale of the benches

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``."""
        return {
            "text": self.text(),
            "terms": [{"function": t.function, "coefficient": t.coefficient} for t in self.terms],
            "held_out_r2": round(self.held_out_r2, 4),
        }

    def text(self) -> str:
        """Return it as a line."""
        name, unit = side_words(self.side, self.scale)
        largest = max(abs(term.coefficient) for term in self.terms)
        worth = [t for t in self.terms if t.function or abs(t.coefficient) > 0.03 * largest]
        parts = [f"{t.coefficient:+.3g} {t.function}".rstrip() for t in worth]
        signed = " ".join(f"{part[0]} {part[1:]}" for part in parts)
        right = signed.removeprefix("+ ").replace("- ", "−" if signed.startswith("-") else "- ", 1)
        return f"{name}, measured − modelled [{unit}] = {right}"


@dataclass(frozen=True, kw_only=True)
class Atom:
    """A function of the signals that a formula may hold: one column, or a sine with its cosine."""

    name: str
    columns: Array  # Shape (M, 1) or (M, 2)
    angle: str | None = None  # Signal in which the function repeats itself
    per_radian: float = 0.0  # Rate of the repetition [1/rad]


def find_equation(
    remainder: Remainder, strongest: Sequence[str], folds: Indices, reachable: float
) -> FoundEquation | None:
    """Return a formula that holds up on data it has not seen; None where none does.

    Terms and numbers are found anew without each fold, and judged on it.

    Args:
        strongest: Signals on which that depends most.
        folds: Fold of each row.
        reachable: Held-out share of the variance that the flexible learner reaches.
    """
    atoms = library(remainder.signals, strongest)
    y = remainder.residual
    missed = 0.0
    for fold in np.unique(folds):
        out = folds == fold
        chosen = pursue([seen(atom, ~out) for atom in atoms], y[~out])
        weights = solve([seen(atoms[k], ~out) for k in chosen], y[~out])
        told = table_of([seen(atoms[k], out) for k in chosen], int(out.sum())) @ weights
        missed += float(np.sum((y[out] - told) ** 2))
    r2 = 1.0 - missed / float(np.sum((y - y.mean()) ** 2))
    if r2 < max(LEAST_R2, LEAST_OF_LEARNER * reachable):
        return None
    chosen = [atoms[k] for k in pursue(atoms, y)]
    terms = written(chosen, solve(chosen, y))
    if not chosen:
        return None
    return FoundEquation(side=remainder.side, terms=terms, held_out_r2=r2, scale=remainder.scale)


def library(signals: Mapping[str, Array], strongest: Sequence[str]) -> list[Atom]:
    """Return the functions that a formula may hold."""
    atoms: list[Atom] = []
    for name in dict.fromkeys([*strongest, "force", "theta_dot"]):
        if name in signals:
            x = signals[name]
            atoms += [
                Atom(name=name, columns=x[:, None]),
                Atom(name=f"{name}^2", columns=x[:, None] ** 2),
            ]
    if "theta_dot" in signals:
        direction = np.tanh(signals["theta_dot"] / STICK)
        atoms.append(Atom(name="sign(theta_dot)", columns=direction[:, None]))
        if "force" in signals:
            atoms.append(
                Atom(
                    name="|force| sign(theta_dot)",
                    columns=(np.abs(signals["force"]) * direction)[:, None],
                )
            )
    for name in ANGLES:
        if name in strongest and name in signals:
            atoms += repetitions(name, signals[name])
    return atoms


def repetitions(name: str, angle: Array) -> list[Atom]:
    """Return a sine with its cosine for each pace at which something may repeat in an angle."""
    reach = float(np.ptp(angle))
    step = 2.0 * np.pi * PERIODS_STEP / reach
    slowest = 2.0 * np.pi / reach
    return [
        Atom(
            name=name,
            columns=np.stack([np.sin(pace * angle), np.cos(pace * angle)], axis=1),
            angle=name,
            per_radian=float(pace),
        )
        for pace in np.arange(slowest, MOST_PER_RADIAN, step)
    ]


def seen(atom: Atom, rows: Mask) -> Atom:
    """Return a function at some rows."""
    return replace(atom, columns=atom.columns[rows])


def pursue(atoms: Sequence[Atom], y: Array) -> list[int]:
    """Add the function that explains most, one at a time; then drop those that are not missed."""
    total = float(np.sum((y - y.mean()) ** 2))
    chosen: list[int] = []
    left = y - y.mean()
    for _ in range(MOST_TERMS):
        known = np.linalg.qr(table_of([atoms[k] for k in chosen], len(y)))[0]
        gains = [0.0 if k in chosen else gain(atom, left, known) for k, atom in enumerate(atoms)]
        best = int(np.argmax(gains))
        if gains[best] < LEAST_STEP * total:
            break
        chosen.append(best)
        left = rest([atoms[k] for k in chosen], y)
    for k in list(chosen):
        others = [atoms[j] for j in chosen if j != k]
        loss = float(np.sum(rest(others, y) ** 2) - np.sum(left**2))
        if loss < LEAST_STEP * total:
            chosen.remove(k)
            left = rest(others, y)
    return chosen


def gain(atom: Atom, left: Array, known: Array) -> float:
    """Return how much of a rest's sum of squares a function explains beside what is known.

    Args:
        left: What the known functions leave, shape (M,).
        known: An orthonormal basis of those, the constant among them, shape (M, K).
    """
    columns = atom.columns - known @ (known.T @ atom.columns)
    weights = np.linalg.lstsq(columns.T @ columns, columns.T @ left, rcond=None)[0]
    return float(weights @ (columns.T @ left))


def rest(atoms: Sequence[Atom], y: Array) -> Array:
    """Return what some functions leave of a signal."""
    return y - table_of(atoms, len(y)) @ solve(atoms, y)


def solve(atoms: Sequence[Atom], y: Array) -> Array:
    """Return the weights of a constant and some functions."""
    return np.asarray(np.linalg.lstsq(table_of(atoms, len(y)), y, rcond=None)[0], np.float64)


def table_of(atoms: Sequence[Atom], rows: int) -> Array:
    """Return a constant and some functions as columns, shape (M, K)."""
    return np.concatenate([np.ones((rows, 1)), *(atom.columns for atom in atoms)], axis=1)


def written(atoms: Sequence[Atom], weights: Array) -> tuple[Term, ...]:
    """Write each function with its coefficient; a sine and its cosine become one with a phase."""
    terms: list[Term] = []
    at = 1
    for atom in atoms:
        own = weights[at : at + atom.columns.shape[1]]
        at += len(own)
        if atom.angle is None:
            terms.append(Term(function=atom.name, coefficient=float(own[0])))
            continue
        phase = atan2(own[1], own[0])
        function = f"sin({atom.per_radian:.3g} {atom.angle} {'-+'[phase >= 0]} {abs(phase):.2f})"
        terms.append(Term(function=function, coefficient=hypot(own[0], own[1])))
    return (Term(function="", coefficient=float(weights[0])), *terms)
