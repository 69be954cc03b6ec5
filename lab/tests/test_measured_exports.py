"""What an export says of each effect is what was measured."""

import json

import pytest

from lab.studies.exports import RESULTS, cases
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.mujoco.mujoco_target import IN_THE_FILE
from tests.exports.models import ANGLE, FORCE

MEASURED = {"mujoco": "tendon_step.py", "newton": "tendon_drive.py"}
"""Targets whose words are measured, and what runs what they write."""

BAR = (1e3 * ANGLE, FORCE)  # mrad, N


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
