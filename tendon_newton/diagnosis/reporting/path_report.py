"""``investigation.html``: how an answer grew, run by run."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tendon_newton.data.plain_numbers import number
from tendon_newton.diagnosis.next_experiment.investigation_log import InvestigationLog, Step
from tendon_newton.diagnosis.reporting.inline_svg import AFTER, BEFORE, INK, svg
from tendon_newton.diagnosis.reporting.page import write_page
from tendon_newton.effects import law_of

TEMPLATE = "path.html.jinja"
SURE = 0.9  # Probability of a cause from which it stands alone [1]
SIZE = (3.6, 1.9)  # Size of one number's panel [inch]


def write_path_report(path: Path, log: InvestigationLog, folder: Path) -> None:
    """Write the page.

    Args:
        folder: Folder of the investigation: the page links to the diagnoses in it.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    answered = [step for step in log.steps if step.probabilities is not None]
    shares = dict((answered[-1].probabilities or {}) if answered else {})
    rows = step_rows(log.steps, folder)
    content = {
        "title": "Investigation",
        "headline": (answered[-1].verdict or "going on").replace("_", " ") if answered else "",
        "ended": log.ended or f"{log.seconds:.0f} s were recorded, and it goes on",
        "runs": log.runs,
        "answer": next((row["link"] for row in reversed(rows) if row["link"]), None),
        "causes": [shown(name, share) for name, share in shares.items() if share >= SURE],
        "open": [shown(name, share) for name, share in shares.items() if share < SURE],
        "steps": rows,
        "by_hand": [step.by_hand for step in log.steps if step.by_hand][-1:],
        "panels": [panel(answered, cause, name) for cause, name in numbers_of(answered)],
        "commands": [command_panel(step) for step in log.steps if step.command is not None],
    }
    write_page(path, "tendon_newton.diagnosis.reporting", TEMPLATE, content)


def shown(name: str, share: float) -> dict[str, str]:
    """Return a cause and the weight of the sets that hold it, in words."""
    return {"name": name.replace("_", " "), "share": f"{share:.0%}"}


def step_rows(steps: Sequence[Step], folder: Path) -> list[dict[str, Any]]:
    """Return what the table shows of each step."""
    rows: list[dict[str, Any]] = []
    run, before = 0, None
    for step in steps:
        run += step.split == "train"
        link = f"diagnosis_{run}/report.html"
        came = (None if before is None else step.brought(before)) or {}
        rows.append(
            {
                "name": step.name,
                "bench": step.bench.replace("_", " "),
                "why": step.why,
                "link": link if step.verdict and (folder / link).exists() else None,
                "causes": ", ".join(name.replace("_", " ") for name in step.causes),
                "expected": bits(step.expected or {}),
                "came": bits(came),
            }
        )
        before = step
    return rows


def bits(told: Mapping[str, float]) -> str:
    """Return information about names and about the task [bit], if there is any."""
    return f"{told['names']:.1f} + {told['task']:.1f}" if told else ""


def numbers_of(steps: Sequence[Step]) -> list[tuple[str, str]]:
    """Return every number that was named at any step, those of the last answer first."""
    found: dict[tuple[str, str], None] = {}
    for step in reversed(steps):
        for cause, numbers in step.causes.items():
            found |= {(cause, name): None for name in numbers}
    return list(found)


def panel(steps: Sequence[Step], cause: str, name: str) -> str:
    """Draw one number with its interval after each run; a run without it leaves a gap.

    An interval without end goes as far as the largest number that is shown.
    """
    unit = next(p.unit for p in law_of(cause).parameters if p.name == name)
    places = [
        (k, step.causes[cause][name], (step.probabilities or {})[cause] < SURE)
        for k, step in enumerate(steps, start=1)
        if name in step.causes.get(cause, {})
    ]

    top = max((u for _, own, _ in places for u in own if math.isfinite(u)), default=0.0)

    def draw(axes: Any) -> None:
        for k, (value, low, high), is_open in places:
            colour = BEFORE if is_open else AFTER
            axes.plot(
                [k, k], [min(low, top), min(high, top)], color=colour, linewidth=5, alpha=0.35
            )
            axes.plot(k, value, "o", color=colour, markersize=5)
        axes.set_xlim(0.5, len(steps) + 0.5)
        axes.set_xticks(range(1, len(steps) + 1), [step.name for step in steps])
        axes.set_ylabel("" if unit == "1" else unit)
        axes.set_title(f"{cause}: {name}".replace("_", " "), color=INK)

    value, low, high = places[-1][1]
    label = f"{cause} {name}: {number(value)}, interval {number(low)} to {number(high)} {unit}"
    return svg(f"{cause}-{name}", label, SIZE, draw)


def command_panel(step: Step) -> str:
    """Draw the command of a run that was designed."""

    def draw(axes: Any) -> None:
        angles = step.command or ()
        time = [step.seconds * k / len(angles) for k in range(len(angles))]
        axes.step(time, angles, where="post", color=AFTER)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("command [rad]")
        axes.set_title(f"{step.name} on {step.bench}".replace("_", " "), color=INK)

    return svg(f"command-{step.name}", f"command of {step.name}", SIZE, draw)
