"""Findings of a refresh, on one page."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tendon_newton.data.files.checked_table import read_checked
from tendon_newton.data.files.together import refuse_mix
from tendon_newton.data.parameters import with_unit
from tendon_newton.diagnosis.in_time.changes_report import CHANGES
from tendon_newton.diagnosis.in_time.walks import walk_of
from tendon_newton.diagnosis.reporting.page import write_page as fill_page
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.errors import InvalidDiagnosis
from tendon_train.refresh.slip import SLIP, SLIPS

PROMISE = "what diagnose --against says is a JSON file"
TEMPLATE = "refresh.html.jinja"
AGREES = "no_drift"
WORN = "worn"
CHANGED = "changed"
CHANGE = 2.0
"""Ratio of the model's errors on new and on earlier logs up to which a bench is the same [1]: under
other goals it is 1.6. What is named below it was there before."""
SLIPPED = 0.1
"""Slip from which on a spool has slipped [rad]: on benches as they were up to 0.025 is found, and
where the gear has run dry -0.16 to -0.24."""


@dataclass(frozen=True, kw_only=True)
class FoundWear:
    """A cause that a diagnosis names."""

    name: str
    words: str  # Reason for the wear, in words
    numbers: tuple[str, ...]  # Parameters of the wear with their intervals, in words
    rivals: tuple[str, ...]  # Causes that the logs cannot tell from this one


@dataclass(frozen=True, kw_only=True)
class Drift:
    """Change of a bench that its logs show."""

    # ``no_drift``; ``worn``, with a name; or ``changed``, by nothing that stands in the list
    verdict: str
    causes: tuple[FoundWear, ...]
    theta_rmse: float  # Error of the old model on the held-out part of the logs [rad]
    # Error of the corrected model on the held-out part of the logs [rad]
    corrected_theta_rmse: float
    # Error of the old model on the held-out part of earlier logs [rad]; None without any
    reference_theta_rmse: float | None


@dataclass(frozen=True, kw_only=True)
class TipFigure:
    """Tip error of a policy, in simulation or on a bench."""

    policy: str
    where: str
    rmse: float  # Distance between tip and goal point, RMS [m]


def judge_drift(
    diagnosis: Diagnosis,
    reference_theta_rmse: float | None = None,
    *,
    grown: float | None = None,
    slip: float | None = None,
) -> Drift:
    """Say what a diagnosis of logs means for the bench.

    Args:
        reference_theta_rmse: The model's error on the held-out part of earlier logs [rad], where
            there are any; only reported.
        grown: Ratio by which the model's error on rows that may be fitted has grown since [1].
        slip: How far the spool has slipped since [rad], by `slip_since`.
    """
    causes = tuple(
        FoundWear(
            name=effect.name,
            words=walk_of(effect.name).words,
            numbers=tuple(
                f"{name} = {with_unit(f'{p.value:.4g}', p.unit)} [{p.ci95[0]:.4g}, {p.ci95[1]:.4g}]"
                for name, p in effect.parameters.items()
            ),
            rivals=effect.indistinguishable_from,
        )
        for effect in diagnosis.effects
    )
    slipped = slip is not None and slip > SLIPPED
    if slip is not None and slipped and not any(cause.name in SLIPS for cause in causes):
        words, number = walk_of(SLIP).words, f"angle = {slip:.4g} rad"
        causes = (FoundWear(name=SLIP, words=words, numbers=(number,), rivals=()),)
    same = not causes if grown is None else grown <= CHANGE
    same = same and not slipped
    return Drift(
        verdict=AGREES if same else WORN if causes else CHANGED,
        causes=() if same else causes,
        theta_rmse=diagnosis.baseline.theta_rmse,
        corrected_theta_rmse=diagnosis.extended.theta_rmse,
        reference_theta_rmse=reference_theta_rmse,
    )


def told_drift(folder: Path) -> Drift:
    """Return what `diagnose --against` says of its last day.

    Args:
        folder: Where it wrote ``changes.json``.

    Raises:
        InvalidDiagnosis: The file is not what it writes.
    """
    said = read_checked(folder / CHANGES, InvalidDiagnosis, PROMISE)
    refuse_mix(folder / CHANGES, said.values, InvalidDiagnosis)
    days = said.table("days")
    last = days.table(list(days.values)[-1] if days.values else "a day")
    moved = [number for number in last.tables("numbers") if number.values.get("moved") is True]
    causes = tuple(
        FoundWear(
            name=(name := number.word("cause")),
            words=walk_of(name).words,
            numbers=(step,),
            rivals=number.words("rivals"),
        )
        for number, step in zip(moved, last.words("next_steps"), strict=False)
    )
    own = last.values.get("on_its_own_day")
    return Drift(
        verdict=WORN if causes else CHANGED if last.word("doubt") else AGREES,
        causes=causes,
        theta_rmse=last.table("before").number("theta_rmse"),
        corrected_theta_rmse=last.table("after").number("theta_rmse"),
        reference_theta_rmse=None
        if own is None
        else last.table("on_its_own_day").number("theta_rmse"),
    )


def headline(drift: Drift) -> str:
    """Return the answer in one sentence; only logs of before show that something has changed."""
    compared = drift.reference_theta_rmse is not None
    if drift.verdict == AGREES:
        return f"The bench {'still ' if compared else ''}is what its model says."
    if drift.verdict == CHANGED:
        return "The bench has changed, and no wear in the list explains it."
    names = " and ".join(
        " or ".join(name.replace("_", " ") for name in (cause.name, *cause.rivals))
        for cause in drift.causes
    )
    if compared:
        return f"The bench has drifted from its model: {names}."
    return (
        f"The bench differs from its model: {names}. Whether it has drifted, or never was as its "
        "model says, logs from when it was new would tell (--reference)."
    )


def write_page(
    path: Path,
    drift: Drift,
    figures: Sequence[TipFigure],
    facts: Mapping[str, str],
    picture: Path | None,
) -> None:
    """Write the page, which needs nothing else.

    Args:
        figures: Tip errors; none where nothing was trained.
        facts: Everything else that a reader wants to know, in order.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    content: dict[str, Any] = {
        "headline": headline(drift),
        "causes": drift.causes,
        "errors": error_rows(drift),
        "figures": [(f.policy, f.where, f"{1e3 * f.rmse:.1f} mm") for f in figures],
        "facts": list(facts.items()),
        "picture": None
        if picture is None
        else base64.b64encode(picture.read_bytes()).decode("ascii"),
    }
    fill_page(path, "tendon_train.refresh", TEMPLATE, content)


def error_rows(drift: Drift) -> list[tuple[str, str]]:
    """Return the errors of the motor's angle in words."""
    rows = [("the model, on these logs", drift.theta_rmse)]
    if drift.reference_theta_rmse is not None:
        rows.insert(0, ("the model, on earlier logs", drift.reference_theta_rmse))
    if drift.causes:
        rows.append(("with what was found, on these logs", drift.corrected_theta_rmse))
    return [(words, f"{1e3 * rmse:.1f} mrad") for words, rmse in rows]
