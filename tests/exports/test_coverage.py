"""Every effect has a row for every target, and the documentation shows the table as it is."""

from pathlib import Path

import pytest

from tendon_newton.effects import EFFECTS
from tendon_newton.errors import UnknownName
from tendon_newton.exports import EXPORTS, find_export
from tendon_newton.exports.mujoco.target import IN_THE_FILE
from tendon_newton.exports.newton.plain import IN_THE_PRIMS

PAGE = Path(__file__).parents[2] / "docs" / "export.md"
WORDS = {"exact": "exact", "approximate": "nearly", "none": "-"}
COLUMNS = {
    "model.xml alone": IN_THE_FILE,
    "Newton's prims alone": IN_THE_PRIMS,
    **{name: target.coverage for name, target in EXPORTS.items()},
}
"""Ways of running an export, and what each says of every effect."""


def coverage_table() -> str:
    """Return what every target says of every effect, in Markdown."""
    lines = [f"| effect | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS)]
    for effect in EFFECTS:
        cells = [WORDS[column[effect]] for column in COLUMNS.values()]
        lines.append(f"| {effect} | {' | '.join(cells)} |")
    return "\n".join(lines)


@pytest.mark.parametrize("target", EXPORTS)
def test_every_effect_has_a_row_for_every_target(target: str) -> None:
    """A new effect is exact, nearly there, or not expressible; nobody may leave that open."""
    coverage = EXPORTS[target].coverage
    assert set(coverage) == set(EFFECTS)
    assert set(coverage.values()) <= set(WORDS)


def test_the_documentation_shows_the_table_as_it_is() -> None:
    """docs/export.md holds the text that the targets' own lists make."""
    assert coverage_table() in PAGE.read_text(encoding="utf-8")


def test_an_unknown_target_is_named_with_the_known_ones() -> None:
    """The message lists what there is."""
    with pytest.raises(UnknownName, match="mujoco"):
        find_export("gazebo")
