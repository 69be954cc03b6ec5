"""``exam.html``: how good the diagnosis is, with the confusion matrix as a picture."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tendon_lab.exam.exam_rates import by_strength, confusion, rates
from tendon_lab.exam.exam_score import Mark
from tendon_newton.data.files.picture import new_figure, save
from tendon_newton.diagnosis.reporting.inline_svg import AFTER, BEFORE, FAINT, INK, svg
from tendon_newton.diagnosis.reporting.page import write_page
from tendon_newton.effects import EFFECTS

TEMPLATE = "exam.html.jinja"
VERDICTS = ("no_gap", "unexplained", "partly_explained", "explained", "no answer")
CELL = 0.24  # Side of a cell of the matrix [inch]
MARGINS = (2.6, 2.4)  # Room for the names beside and below the matrix [inch]


class Matrix:
    """The confusion matrix of all cases but pairs: what was hidden against what was said first.

    Args:
        marks: All answers.
    """

    def __init__(self, marks: Sequence[Mark]) -> None:
        alone = [m for m in marks if m.truth.family != "pair"]
        self.counts = confusion(alone)
        catalogue = [*EFFECTS, "nothing"]
        outside = sorted({m.truth.causes for m in alone if m.truth.family == "outside"})
        self.rows = [name for name in (*catalogue, *outside) if name in self.counts]
        said = {name for row in self.counts.values() for name in row}
        self.columns = [name for name in (*EFFECTS, *VERDICTS) if name in said]
        self.accepted = {
            (m.truth.causes, m.said[0] if m.said else m.verdict) for m in alone if m.right
        }

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the picture [inch]."""
        return (
            MARGINS[0] + CELL * max(1, len(self.columns)),
            MARGINS[1] + CELL * max(1, len(self.rows)),
        )

    def draw(self, axes: Any) -> None:
        """Draw a square per pair of names, its count inside; right answers in blue."""
        for y, truth in enumerate(self.rows):
            for x, said in enumerate(self.columns):
                if not (count := self.counts[truth].get(said, 0)):
                    continue
                share = count / sum(self.counts[truth].values())
                color = AFTER if (truth, said) in self.accepted else BEFORE
                axes.fill(
                    [x - 0.46, x + 0.46, x + 0.46, x - 0.46],
                    [y - 0.46, y - 0.46, y + 0.46, y + 0.46],
                    color=color,
                    alpha=0.15 + 0.35 * share,
                    linewidth=0.0,
                )
                axes.annotate(str(count), (x, y), ha="center", va="center", fontsize=8, color=INK)
        axes.set_xticks(range(len(self.columns)), labels(self.columns), rotation=90, fontsize=8)
        axes.set_yticks(range(len(self.rows)), labels(self.rows), fontsize=8)
        axes.set_xlim(-0.6, len(self.columns) - 0.4)
        axes.set_ylim(len(self.rows) - 0.4, -0.6)
        axes.set_xlabel("named first, or the verdict")
        axes.set_ylabel("hidden")
        axes.set_axisbelow(True)
        axes.grid(color=FAINT, linewidth=0.4)


def labels(names: Sequence[str]) -> list[str]:
    """Return names as words."""
    return [name.replace("_", " ") for name in names]


def write_exam_report(folder: Path, marks: Sequence[Mark]) -> None:
    """Write ``exam.html`` and ``confusion.png``.

    Raises:
        InvalidOutput: A file cannot be written.
    """
    matrix = Matrix(marks)
    write_page(folder / "exam.html", "tendon_lab.exam", TEMPLATE, content(marks, matrix))
    figure = new_figure(*matrix.size)
    matrix.draw(figure.subplots())
    save(figure, folder / "confusion.png", dpi=130)


def content(marks: Sequence[Mark], matrix: Matrix) -> Mapping[str, Any]:
    """Return what the template shows."""
    wrong = [m for m in marks if not m.right and not m.truth.weak]
    return {
        "cases": len(marks),
        "right": sum(m.right for m in marks),
        "rates": [(r.name, figure(r.name, r.value), r.cases) for r in rates(marks)],
        "strengths": [
            (
                f"{b.low:g} to {b.high:g}",
                b.cases,
                *(f"{100.0 * x:.0f} %" for x in (b.first, b.in_class, b.silent, b.wrong)),
            )
            for b in by_strength(marks)
        ],
        "matrix": svg(
            "confusion", "what was hidden against what was named", matrix.size, matrix.draw
        ),
        "width": round(96.0 * matrix.size[0]),
        "wrong": [
            (
                m.truth.id,
                m.truth.family,
                m.truth.causes.replace("_", " "),
                ", ".join(" or ".join(names) for names in m.classes).replace("_", " ") or "nothing",
                m.verdict.replace("_", " "),
                f"{m.truth.strength:.1f}",
            )
            for m in sorted(wrong, key=lambda m: m.truth.id)
        ],
    }


def figure(name: str, value: float) -> str:
    """Return a figure as its name wants it: a number of its own, or a share."""
    if name.startswith("seconds"):
        return f"{value:.1f} s"
    if name.startswith("peak memory"):
        return f"{value:.0f} MiB"
    return f"{100.0 * value:.1f} %"
