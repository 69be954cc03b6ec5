"""The tables and key numbers of a report."""

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from tendon_newton import __version__
from tendon_newton.data.checks.finding import Finding, kinds_of
from tendon_newton.data.plain_numbers import estimate_text, number, quantity
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.diagnosis.accounts.checked_data import findings_of
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.reporting.held_out import HeldOutComparison
from tendon_newton.diagnosis.reporting.report_causes import Row
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.identification.signals import SIGNALS

NEARLY_ALL = 0.9995  # Shares above round to 100.0 %
AT_REST = 0.02  # Share of the greatest speed up to which a servo is at rest [1]
SLACK = 5.0  # Noise floors of force up to which a string that never pushes is slack [1]
PACKAGES = ("newton", "warp-lang", "numpy")


def key_numbers(diagnosis: Diagnosis) -> list[Row]:
    """Return the few numbers that stand beside the verdict."""
    before, after = diagnosis.baseline, diagnosis.extended
    named = bool(diagnosis.effects)
    items: list[Row] = []
    if named:
        low, high = diagnosis.explained_interval
        items.append(
            {
                "label": "of the held-out gap explained",
                "value": f"{percent(diagnosis.explained_fraction)} %",
                "note": f"95 % interval above {percent(min(low, 0.999))} %"
                if high > NEARLY_ALL
                else f"95 % interval {percent(low, high)} to {percent(high)} %",
            }
        )
    further = {s: (SIGNALS[s].words, *SIGNALS[s].shown) for s in before.others_rmse}
    for signal, (name, scale, unit) in {
        "theta": (diagnosis.angle_name, 1e3, "mrad"),
        "force": (diagnosis.scale.force_name, 1.0, diagnosis.scale.force_unit),
        **further,
    }.items():
        top, left, floor = before.of(signal), after.of(signal), diagnosis.noise_of(signal)
        if not top or left is None:  # an angle that was given leaves nothing
            continue
        change = f"{number(scale * top)} → {number(scale * left)}" if named else number(scale * top)
        note = "" if floor is None else f"noise of the sensor {number(scale * floor, 2)} {unit}"
        items.append({"label": f"{name}, RMS error", "value": f"{change} {unit}", "note": note})
    return items


def percent(share: float, beside: float = 0.0) -> str:
    """Return a share in per cent, finer where it or what stands beside it is nearly all."""
    if share > NEARLY_ALL:
        return "> 99.9" if share < 1.0 else "100"
    decimals = 1 if max(share, beside) > 0.95 else 0
    rounded = round(100.0 * share, decimals) + 0.0  # no minus before nothing
    return f"{rounded:.{decimals}f}".replace("-", "−")


def finding_rows(train: Sequence[Recording], test: Sequence[Recording]) -> dict[str, list[Row]]:
    """Check the recordings; return what misleads and, apart from it, what is good to know."""
    found = findings_of(train, test)
    rows = [
        {
            "severity": group[0].severity,
            "channel": group[0].channel,
            "consequence": group[0].consequence,
            "evidence": evidence_text(group),
        }
        for group in kinds_of(found)
    ]
    return {
        "findings": [row for row in rows if row["severity"] != "note"],
        "remarks": [row for row in rows if row["severity"] == "note"],
    }


def evidence_text(group: list[Finding]) -> str:
    """Return the first of several equal findings, and how many recordings share it."""
    first = group[0]
    more = "" if len(group) == 1 else f" (and {len(group) - 1} more recordings)"
    return f"{first.recording}: {first.evidence}{more}"


def model_rows(diagnosis: Diagnosis, evidence: Evidence) -> list[Row]:
    """Put the numbers of the starting and of the extended model side by side."""
    named = {effect.name for effect in diagnosis.effects}
    model = diagnosis.model
    rows: list[Row] = []
    for entry in (model.actuator, *model.effects):
        part = "actuator: " * (entry is model.actuator) + entry.cause.replace("_", " ")
        for key, value in entry.values.items():
            before, unit = starting_value(evidence, entry.cause, key)
            if entry.name == model.actuator.name and key in model.fit:
                earlier = before if before is None else f"unknown, fitted {before}"
            else:
                earlier = before
            after = value if isinstance(value, str) else quantity(value, unit)
            rows.append(
                {
                    "part": part,
                    "number": key.replace("_", " "),
                    "before": after if earlier is None else earlier,
                    "after": after,
                    "new": entry.cause in named,
                }
            )
    return rows


def starting_value(evidence: Evidence, owner: str, key: str) -> tuple[str | None, str]:
    """Return a number of the starting model in words, if the kernels hold it, and its unit."""
    study = evidence.train
    for column in study.table.columns(owner):
        parameter = study.table.owners[column][1]
        if parameter.name == key:
            value = evidence.baseline.get(column, study.base_value(column))
            absent = value == parameter.null and owner != study.table.actuator
            return ("—" if absent else quantity(value, parameter.unit)), parameter.unit
    return None, "m" if key == "spool_radius" else "1"


def regimes(recording: Recording, noise: float | None) -> dict[str, Mask]:
    """Return the rows (T,) of each regime: each row is in one.

    Args:
        noise: Noise floor of its force [N]; None without a load cell.
    """
    speed = np.abs(recording.motor_velocity[:, 0])
    off = ~recording.enabled
    slack = np.zeros_like(off)
    if recording.force is not None and noise and recording.force.min() > -SLACK * noise:
        slack = ~off & (recording.force[:, 0] < SLACK * noise)
    still = ~off & ~slack & (speed <= AT_REST * speed.max())
    return {"motor off": off, "string slack": slack, "at rest": still,
            "in motion": ~(off | slack | still)}  # fmt: skip


def regime_rows(
    diagnosis: Diagnosis, comparisons: Sequence[HeldOutComparison], signal: str
) -> list[tuple[str, str]]:
    """Return the angle's or the force's error by regime, before and after, with its share of rows.

    What dry friction holds at rest depends on how a motion ended: a force may be off there alone.
    """
    name, unit, scale = {"theta": ("angle", "mrad", 1e3),
                         "force": ("force", diagnosis.scale.force_unit, 1.0)}[signal]  # fmt: skip
    left, masks = list[Array](), list[dict[str, Mask]]()
    for comparison in comparisons:
        if (own := comparison.residual(signal)) is not None:
            known = ~np.isnan(own[0])
            there = regimes(comparison.recording, diagnosis.noise_force)
            left.append(own)
            masks.append({regime: rows & known for regime, rows in there.items()})
    total = sum(int(rows.sum()) for mask in masks for rows in mask.values())
    rows: list[tuple[str, str]] = []
    for regime in masks[0] if total else ():
        share = sum(int(mask[regime].sum()) for mask in masks) / total
        if share > 0.0:
            pair = (np.concatenate([o[k][m[regime]] for o, m in zip(left, masks, strict=True)])
                    for k in ((0, 1) if diagnosis.effects else (0,)))  # fmt: skip
            change = " → ".join(number(scale * rms(residual)) for residual in pair)
            rows.append((f"RMS error of the {name}, {regime}",
                         f"{change} {unit}, {percent(share)} % of the rows"))  # fmt: skip
    return rows


def detail_rows(
    diagnosis: Diagnosis,
    evidence: Evidence,
    comparisons: Sequence[HeldOutComparison],
    command: str | None,
) -> list[tuple[str, str]]:
    """Return the numbers for the curious."""
    pair = (diagnosis.baseline, diagnosis.extended) if diagnosis.effects else (diagnosis.baseline,)
    mean = " → ".join(number(1e3 * errors.theta_mae) for errors in pair)
    angle = [("mean absolute error of the angle", f"{mean} mrad")]
    angle += regime_rows(diagnosis, comparisons, "theta")
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    rows = [
        ("verdict", diagnosis.verdict.replace("_", " ")),
        ("effects tried", str(len(diagnosis.candidates))),
        *(angle if diagnosis.baseline.theta_mae else []),
        *regime_rows(diagnosis, comparisons, "force"),
        ("recordings to learn from", ", ".join(r.name for r in evidence.train.wholes)),
        ("recordings held out", ", ".join(r.name for r in evidence.test.wholes)),
        ("wall time", f"{diagnosis.wall_time_s:.0f} s"),
        ("versions", ", ".join([f"tendon-newton {__version__}", *packages])),
    ]
    for name, estimate in diagnosis.fitted.items():
        value, interval = estimate_text(diagnosis.model.actuator.name, name, estimate)
        rows.append((f"fitted {name.replace('_', ' ')}", f"{value}, 95 % interval {interval}"))
    return rows if command is None else [*rows, ("command", command)]
