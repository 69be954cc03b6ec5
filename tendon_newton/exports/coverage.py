"""The table of effects by target, as the documentation shows it."""

from __future__ import annotations

from collections.abc import Mapping

from tendon_newton.effects import EFFECTS
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.base import Coverage
from tendon_newton.exports.mujoco_target import IN_THE_FILE
from tendon_newton.exports.newton.plain import IN_THE_PRIMS

WORDS: dict[Coverage, str] = {"exact": "exact", "approximate": "nearly", "none": "-"}
COLUMNS: dict[str, Mapping[str, Coverage]] = {
    "model.xml alone": IN_THE_FILE,
    "Newton's prims alone": IN_THE_PRIMS,
    **{name: target.coverage for name, target in EXPORTS.items()},
}
"""Ways of running an export, and what each says of every effect."""


def coverage_table() -> str:
    """Return what every target says of every effect, in Markdown."""
    lines = [
        f"| effect | {' | '.join(COLUMNS)} |",
        "|---|" + "---|" * len(COLUMNS),
    ]
    for effect in EFFECTS:
        cells = [WORDS[column[effect]] for column in COLUMNS.values()]
        lines.append(f"| {effect} | {' | '.join(cells)} |")
    return "\n".join(lines)
