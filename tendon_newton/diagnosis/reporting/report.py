"""``report.html``: a diagnosis for people, in one file that needs nothing else."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.report_words import consequence, headline
from tendon_newton.diagnosis.reporting.held_out import (
    WINDOW,
    HeldOutComparison,
    compare,
    row_weights,
    telling_windows,
)
from tendon_newton.diagnosis.reporting.page import write_page
from tendon_newton.diagnosis.reporting.report_captions import captions
from tendon_newton.diagnosis.reporting.report_causes import (
    actuator_rows,
    cause_rows,
    errors_text,
    rival_rows,
)
from tendon_newton.diagnosis.reporting.report_doubts import doubts
from tendon_newton.diagnosis.reporting.report_figures import SIGNALS, Panels, full_name
from tendon_newton.diagnosis.reporting.report_finger import moving_fingers
from tendon_newton.diagnosis.reporting.report_tables import (
    detail_rows,
    finding_rows,
    key_numbers,
    model_rows,
)
from tendon_newton.diagnosis.result import Diagnosis

TEMPLATE = "report.html.jinja"


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Origin of a diagnosis, as far as is known."""

    dataset: Path | None = None  # Folder of the recordings
    command: str | None = None  # Command line that made the report

    def quotation(self) -> str | None:
        """Return the first paragraph of the dataset's README; None without one."""
        readme = None if self.dataset is None else self.dataset / "README.md"
        if readme is None or not readme.is_file():
            return None
        blocks = readme.read_text(encoding="utf-8", errors="replace").split("\n\n")
        prose = (
            " ".join(b.split()) for b in blocks if b.strip() and not b.lstrip().startswith("#")
        )
        return next(prose, "").replace("`", "") or None


def write_report(
    path: Path, diagnosis: Diagnosis, evidence: Evidence, origin: Origin | None = None
) -> None:
    """Write the page.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    shown = content(diagnosis, evidence, origin or Origin())
    shown["folder"] = shlex.quote(str(path.parent))
    write_page(path, "tendon_newton.diagnosis.reporting", TEMPLATE, shown)


def content(diagnosis: Diagnosis, evidence: Evidence, origin: Origin) -> dict[str, Any]:
    """Return what the template shows."""
    comparisons = compare(evidence)
    train = evidence.train.wholes
    benches = ", ".join(dict.fromkeys(r.bench.replace("_", " ") for r in train))
    name = origin.dataset.resolve().name if origin.dataset else benches
    return {
        "title": f"{headline(diagnosis)} {name}",
        "subject": f"{name}: {count(len(train), 'recording')} to learn from, "
        f"{len(evidence.test.wholes)} held out ({benches})",
        "headline": headline(diagnosis),
        **answer(diagnosis),
        "consequence": consequence(diagnosis),
        "next_steps": diagnosis.next_steps,
        "separable": diagnosis.separable,
        "numbers": key_numbers(diagnosis),
        "quotation": origin.quotation(),
        **pictures(diagnosis, evidence, comparisons),
        **captions(diagnosis),
        **finding_rows(train, evidence.test.wholes),
        "notes": [*doubts(diagnosis), *diagnosis.notes],
        "model": model_rows(diagnosis, evidence),
        "details": detail_rows(diagnosis, evidence, comparisons, origin.command),
    }


def answer(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the tables of the first screen."""
    scale, servos = diagnosis.scale, diagnosis.servos
    return {
        "causes": [
            *actuator_rows(diagnosis.actuator, scale),
            *cause_rows(diagnosis.effects, scale, servos),
        ],
        "suspected": cause_rows(diagnosis.suspected, scale, servos),
        "rivals": rival_rows(diagnosis.rivals, scale),
        "with_all": errors_text(diagnosis.extended, scale),
    }


def count(number: int, thing: str) -> str:
    """Return a number with its thing, in the plural where it needs one."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def pictures(
    diagnosis: Diagnosis, evidence: Evidence, comparisons: tuple[HeldOutComparison, ...]
) -> Mapping[str, Any]:
    """Draw all panels."""
    panels = Panels(diagnosis, comparisons)
    windows = telling_windows(comparisons, gap=diagnosis.verdict != "no_gap")
    sizes = {signal: panels.before(signal) for signal in SIGNALS}
    worst = max(comparisons, key=lambda c: float(row_weights(c, sizes).sum()))
    found = bool(diagnosis.effects)
    return {
        "fingers": moving_fingers(evidence, diagnosis.model, windows, found=found),
        "windows": [
            {
                "title": f"{full_name(w.comparison.recording.name)}, {w.start:.1f} to "
                f"{min(w.start + WINDOW, w.comparison.time[-1]):.1f} s",
                "panels": [
                    panels.window(f"window{k}-{signal}", w, signal)
                    for signal in panels.signals
                    if w.comparison.residual(signal) is not None
                ],
            }
            for k, w in enumerate(windows)
        ],
        "residual_title": full_name(worst.recording.name),
        "traces": [
            panels.residual_trace(f"trace-{s}", worst, s)
            for s in panels.signals
            if worst.residual(s) is not None
        ],
        "spreads": [panels.residual_spread(f"spread-{s}", s) for s in panels.signals],
        "ranking": panels.ranking("ranking"),
        "errors": [panels.errors(f"errors-{s}", s) for s in panels.signals],
        **remainder(diagnosis, panels),
    }


def remainder(diagnosis: Diagnosis, panels: Panels) -> Mapping[str, Any]:
    """Draw what remains."""
    structure = diagnosis.unexplained.structure
    if structure is None:
        return {"remainders": []}
    drawn = [
        panels.remainder(f"remainder-{k}", structure, profile)
        for k, profile in enumerate(structure.profiles)
    ]
    return {"remainders": drawn}
