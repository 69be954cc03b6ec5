"""Every effect has a row for every target, and the documentation shows the table as it is."""

import json
from pathlib import Path

import pytest

from examples.studies.exports import RESULTS, cases
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import UnknownName
from tendon_newton.exports import EXPORTS, find_export
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE
from tendon_newton.exports.newton.plain import IN_THE_PRIMS
from tests.exports.models import ANGLE, FORCE

PAGE = Path(__file__).parents[2] / "docs" / "export.md"
WORDS = {"exact": "exact", "approximate": "nearly", "none": "-"}
COLUMNS = {
    "model.xml alone": IN_THE_FILE,
    "Newton's prims alone": IN_THE_PRIMS,
    **{name: target.coverage for name, target in EXPORTS.items()},
}
"""Ways of running an export, and what each says of every effect."""
MEASURED = {"mujoco": "tendon_step.py", "newton": "tendon_drive.py", "bam": "bam_servo.py"}
"""Targets whose words are measured, and what runs what they write."""
BAR = (1e3 * ANGLE, FORCE)  # mrad, N


def coverage_table() -> str:
    """Return what every target says of every effect, in Markdown; equal rows are one."""
    same: dict[str, list[str]] = {}
    for effect in EFFECTS:
        cells = " | ".join(WORDS[column[effect]] for column in COLUMNS.values())
        same.setdefault(cells, []).append(effect)
    lines = [f"| effect | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS)]
    return "\n".join([*lines, *(f"| {', '.join(names)} | {row} |" for row, names in same.items())])


@pytest.mark.parametrize("target", EXPORTS)
def test_every_effect_has_a_row_for_every_target(target: str) -> None:
    """A new effect is exact, nearly there, or not expressible; nobody may leave that open."""
    coverage = EXPORTS[target].coverage
    assert set(coverage) == set(EFFECTS)
    assert set(coverage.values()) <= set(WORDS)


def test_the_documentation_shows_the_table_as_it_is() -> None:
    """docs/export.md holds the text that the targets' own lists make."""
    assert coverage_table() in PAGE.read_text(encoding="utf-8")


def measured(target: str, way: str) -> dict[tuple[str, str, str | None], tuple[float, float]]:
    """Return how far a way of running an export strays [mrad, N], by bench, actuator and effect."""
    rows = json.loads(RESULTS.read_text(encoding="utf-8"))[target]
    return {(r["bench"], r["actuator"], r["effect"]): tuple(r[way]) for r in rows if way in r}


def within(stray: tuple[float, float]) -> bool:
    """Tell whether a run is within a count of an encoder and the noise of a load cell."""
    return all(value < most for value, most in zip(stray, BAR, strict=True))


@pytest.mark.parametrize("target", MEASURED)
def test_every_bench_is_within_the_bar_that_a_target_can_hold(target: str) -> None:
    """All pairs of bench and actuator were run, or refused with a reason."""
    rows = measured(target, MEASURED[target])
    kept = json.loads(RESULTS.read_text(encoding="utf-8"))[target]
    refused = {(row["bench"], row["actuator"]) for row in kept if "refused" in row}
    pairs = {(bench, actuator) for bench, actuator, _ in cases(target)}
    plain = {key[:2]: stray for key, stray in rows.items() if key[2] is None}
    assert set(plain) == pairs - refused
    assert all(within(stray) for stray in plain.values())


@pytest.mark.parametrize("target", MEASURED)
def test_exact_is_said_of_what_was_measured_within_the_bar_and_of_nothing_else(target: str) -> None:
    """An effect is nearly there if one of its runs is beyond the bar."""
    rows = measured(target, MEASURED[target])
    for effect, word in EXPORTS[target].coverage.items():
        own = [within(stray) for key, stray in rows.items() if key[2] == effect]
        expected = "none" if not own else "exact" if all(own) else "approximate"
        assert word == expected, effect


def test_the_file_alone_adds_nothing_by_effects_that_it_has() -> None:
    """With an exact effect it strays from ours as without, to the bar."""
    rows = measured("mujoco", "model.xml alone")
    for (bench, actuator, effect), stray in rows.items():
        if effect is not None and IN_THE_FILE[effect] == "exact":
            plain = rows[bench, actuator, None]
            assert within((stray[0] - plain[0], stray[1] - plain[1])), (actuator, effect)


def test_an_unknown_target_is_named_with_the_known_ones() -> None:
    """The message lists what there is."""
    with pytest.raises(UnknownName, match="mujoco"):
        find_export("gazebo")
