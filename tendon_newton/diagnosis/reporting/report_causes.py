"""The tables that a report begins with: causes that are named or suspected, and their rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.plain_numbers import estimate_text, number
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.owner import with_owner
from tendon_newton.diagnosis.reporting.report_words import cause_sentence, docstring_part
from tendon_newton.diagnosis.result import Errors, NamedEffect

Row = dict[str, Any]
"""Cells of a table's row, for the template."""


@dataclass(frozen=True, kw_only=True)
class Rival:
    """One whole answer, and how well it predicts recordings that it was not fitted on."""

    name: str
    """Its causes, in words."""
    errors: Errors
    chosen: bool = False
    """Whether the diagnosis gives this one."""


def cause_rows(
    causes: Sequence[NamedEffect], scale: BenchScale, servos: int = 1, reasons: Sequence[str] = ()
) -> list[Row]:
    """Describe causes.

    Args:
        causes: Named or suspected ones.
        scale: Of the benches.
        servos: Servos of each bench.
        reasons: Sentence for each cause: why it is only suspected.
    """
    return [
        {
            "name": with_owner(cause.name, servos),
            "side": cause.side,
            "sentence": cause_sentence(cause),
            "parameters": parameter_rows(cause),
            "without": errors_text(cause.without, scale),
            "rivals": [rival.replace("_", " ") for rival in cause.indistinguishable_from],
            "experiment": (cause.separating_experiment or "").replace("_", " "),
            "meaning": docstring_part(cause.name),
            "signature": docstring_part(cause.name, "Signature"),
            "source": docstring_part(cause.name, "Source"),
            "reason": reason,
        }
        for cause, reason in zip(causes, reasons or [""] * len(causes), strict=True)
    ]


def parameter_rows(cause: NamedEffect) -> list[Row]:
    """Describe the numbers of a cause; a single one needs no name."""
    rows: list[Row] = []
    for name, estimate in cause.parameters.items():
        value, interval = estimate_text(effect_of(cause.name), name, estimate)
        label = name.replace("_", " ") if len(cause.parameters) > 1 else ""
        rows.append(
            {"label": label, "value": value, "interval": interval, "at_bound": estimate.at_bound}
        )
    return rows


def rival_rows(rivals: Sequence[Rival], scale: BenchScale) -> list[Row]:
    """Describe whole answers, the best first."""
    best_first = sorted(rivals, key=lambda rival: rival.errors.theta_rmse)
    return [
        {"name": r.name, "errors": errors_text(r.errors, scale), "chosen": r.chosen}
        for r in best_first
    ]


def errors_text(errors: Errors, scale: BenchScale) -> str:
    """Return pooled errors in words."""
    theta = f"{number(1e3 * errors.theta_rmse)} mrad"
    if errors.force_rmse is None:
        return theta
    return f"{theta}, {number(errors.force_rmse)} {scale.force_unit}"
