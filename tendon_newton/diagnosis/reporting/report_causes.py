"""The tables that a report begins with: causes that are named or suspected, and their rivals."""

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from tendon_newton.actuators import find_actuator
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.plain_numbers import estimate_text, number
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.report_words import cause_sentence, docstring_part, with_owner
from tendon_newton.diagnosis.result import ActuatorFound, Errors, Estimate, NamedEffect, Rival
from tendon_newton.identification.signals import SIGNALS

Row = dict[str, Any]  # Cells of a table's row, for the template


def cause_rows(causes: Sequence[NamedEffect], scale: BenchScale, servos: int = 1) -> list[Row]:
    """Describe causes."""
    return [
        {
            "name": with_owner(cause.name, servos),
            "side": cause.side,
            "sentence": cause_sentence(cause),
            "parameters": parameter_rows(effect_of(cause.name), cause.parameters),
            "without": errors_text(cause.without, scale),
            "rivals": [rival.replace("_", " ") for rival in cause.indistinguishable_from],
            "experiment": (cause.separating_experiment or "").replace("_", " "),
            "meaning": docstring_part(cause.name),
            "signature": docstring_part(cause.name, "Signature"),
            "source": docstring_part(cause.name, "Source"),
            "reason": cause.reason,
        }
        for cause in causes
    ]


def actuator_rows(found: ActuatorFound | None, scale: BenchScale) -> list[Row]:
    """Describe what was wrong with the actuator itself, as a cause."""
    if found is None:
        return []
    about = inspect.getdoc(find_actuator(found.kind)) or ""
    return [
        {
            "name": f"the actuator {found.stated}",
            "side": "actuator",
            "sentence": found.sentence,
            "parameters": parameter_rows(found.kind, found.parameters),
            "without": errors_text(found.without, scale),
            "rivals": [],
            "experiment": "",
            "meaning": about.splitlines()[0],
            "signature": "",
            "source": "",
            "reason": "",
        }
    ]


def parameter_rows(owner: str, parameters: Mapping[str, Estimate]) -> list[Row]:
    """Describe the numbers of a cause; a single one needs no name."""
    rows: list[Row] = []
    for name, estimate in parameters.items():
        value, interval = estimate_text(owner, name, estimate)
        label = name.replace("_", " ") if len(parameters) > 1 else ""
        rows.append(
            {"label": label, "value": value, "interval": interval, "at_bound": estimate.at_bound}
        )
    return rows


def rival_rows(rivals: Sequence[Rival], scale: BenchScale) -> list[Row]:
    """Describe whole answers in their order."""
    return [
        {"name": r.name, "errors": errors_text(r.errors, scale), "chosen": r.chosen} for r in rivals
    ]


def errors_text(errors: Errors, scale: BenchScale) -> str:
    """Return pooled errors in words; an angle that was given has none."""
    force = errors.force_rmse
    told = [f"{number(1e3 * errors.theta_rmse)} mrad"] if errors.theta_rmse or not force else []
    told += [] if force is None else [f"{number(force)} {scale.force_unit}"]
    for signal, size in errors.others_rmse.items():
        factor, unit = SIGNALS[signal].shown
        told.append(f"{number(factor * size)} {unit} ({SIGNALS[signal].words})")
    return ", ".join(told)
