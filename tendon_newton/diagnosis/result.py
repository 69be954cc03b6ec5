"""What a diagnosis says, and its JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from tendon_newton.model_file import Model

Verdict = Literal["no_gap", "explained", "partly_explained", "unexplained"]
SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Held-out closed-loop errors, pooled over all rows of the test recordings."""

    force_rmse: float | None
    """[N]; None without a load cell."""
    theta_rmse: float
    """[rad]"""
    theta_mae: float
    """Mean absolute error [rad]."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One fitted number."""

    value: float
    ci95: tuple[float, float]
    """95 % interval, from the scatter between blocks of time."""
    unit: str
    at_bound: bool = False
    """Whether the fit ended at the edge of the parameter's range."""


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """A cause that passed its gates."""

    name: str
    side: str
    parameters: Mapping[str, Estimate]
    without: Errors
    """Held-out errors of the model without it, everything else as found."""
    indistinguishable_from: tuple[str, ...] = ()
    """Effects that this data cannot tell from it."""
    separating_experiment: str | None = None
    """What to record to tell them apart."""


@dataclass(frozen=True, kw_only=True)
class CandidateScore:
    """How one effect did when tried alone on the starting model."""

    name: str
    score: float
    """Share of the loss above the noise that it removes on folds it was not fitted on."""
    values: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Unexplained:
    """What remains when all named effects are in."""

    fraction: float
    """Share of the held-out squared error above the noise."""
    depends_on: tuple[str, ...] = ()
    """Signals that it correlates with, strongest first."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The answer to: what does this model get wrong about these recordings?"""

    verdict: Verdict
    wall_time_s: float
    baseline: Errors
    extended: Errors
    noise_force: float | None
    """Noise of the load cell [N]."""
    noise_theta: float
    """Noise of the encoder [rad]."""
    explained_fraction: float
    """Share of the held-out squared error above the noise that the named effects remove."""
    explained_interval: tuple[float, float]
    """95 % block-bootstrap interval of it."""
    effects: tuple[NamedEffect, ...]
    candidates: tuple[CandidateScore, ...]
    unexplained: Unexplained
    model: Model
    """The extended model."""
    p_value: float
    """Chance of the best candidate's gain if the residual were noise of its own colour."""
    fitted: Mapping[str, Estimate] = field(default_factory=dict)
    """Numbers of the model's ``fit`` list."""
    notes: tuple[str, ...] = ()
    """What the reader must know: sides that could not be tested, defects of the data."""

    def to_json(self) -> dict[str, Any]:
        """Return the contract's dictionary."""
        return {
            "schema": SCHEMA,
            "wall_time_s": round(self.wall_time_s, 2),
            "verdict": self.verdict,
            "p_value": self.p_value,
            "baseline": errors_json(self.baseline),
            "extended": errors_json(self.extended),
            "noise_floor": {"force": self.noise_force, "theta": self.noise_theta},
            "explained_fraction": self.explained_fraction,
            "explained_fraction_ci95": list(self.explained_interval),
            "effects": [effect_json(effect, self.extended) for effect in self.effects],
            "candidates": [
                {"name": c.name, "score": c.score, "parameters": dict(c.values)}
                for c in self.candidates
            ],
            "unexplained": {
                "fraction": self.unexplained.fraction,
                "depends_on": list(self.unexplained.depends_on),
            },
            "fitted": {name: estimate_json(value) for name, value in self.fitted.items()},
            "notes": list(self.notes),
        }


def errors_json(errors: Errors) -> dict[str, float | None]:
    """Return errors as the contract names them."""
    return {
        "force_rmse": errors.force_rmse,
        "theta_rmse": errors.theta_rmse,
        "theta_mae": errors.theta_mae,
    }


def estimate_json(estimate: Estimate) -> dict[str, Any]:
    """Return one fitted number as the contract names it."""
    out: dict[str, Any] = {
        "value": estimate.value,
        "ci95": list(estimate.ci95),
        "unit": estimate.unit,
    }
    if estimate.at_bound:
        out["at_bound"] = True
    return out


def effect_json(effect: NamedEffect, extended: Errors) -> dict[str, Any]:
    """Return one named effect as the contract names it."""
    gain: dict[str, Any] = {"theta_rmse": [effect.without.theta_rmse, extended.theta_rmse]}
    if extended.force_rmse is not None:
        gain["force_rmse"] = [effect.without.force_rmse, extended.force_rmse]
    return {
        "name": effect.name,
        "side": effect.side,
        "parameters": {name: estimate_json(value) for name, value in effect.parameters.items()},
        "gain": gain,
        "indistinguishable_from": list(effect.indistinguishable_from),
        "separating_experiment": effect.separating_experiment,
    }


def write_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    """Write ``diagnosis.json``."""
    path.write_text(json.dumps(diagnosis.to_json(), indent=1) + "\n", encoding="utf-8")
