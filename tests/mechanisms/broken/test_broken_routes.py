"""Routed strings with one thing wrong: each rule of theirs is violated once, and says so."""

from pathlib import Path

import pytest

from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.rules.stage_rules import stage_findings
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tests.mechanisms.broken.flat_assets import write_changed

BASE, NEAR = "</finger_routed/base/", "</finger_routed/proximal_phalanx/"
EXIT, PULLEY, FIRST = f"{BASE}flexor_exit>", f"{BASE}flexor_pulley>", f"{NEAR}flexor_a1>"
ABOVE = f"{BASE}flexor_above>"
END = "</finger_routed/distal_phalanx/flexor_end>"
SIDES = "mjc:sideSites:indices = [-1, 0, -1, -1, -1, -1, -1]"
SPATIAL = 'uniform token mjc:type = "spatial"'
PULLEY_PLACE = "translate = (-0.014, 0, -0.0165)"
ABOVE_PLACE = "translate = (-0.014, 0, -0.0105)"
A3_PLACE, A4_PLACE = "translate = (0.011, 0, -0.0068)", "translate = (0.02, 0, -0.006)"

Change = tuple[str, str]
Fault = tuple[str, str, tuple[Change, ...]]


def path_of(*targets: str) -> tuple[Change, ...]:
    """Return the changes that make a string of other places; its sites are its tendon:path."""
    sites = [target for target in targets if target in (EXIT, ABOVE, FIRST, END)]
    sides = [0 if target == PULLEY else -1 for target in targets]
    return (
        ("rel mjc:path = [", f"rel mjc:path = [{', '.join(targets)}]\n rel old:a = ["),
        ("rel tendon:path = [", f"rel tendon:path = [{', '.join(sites)}]\n rel old:b = ["),
        (SIDES, f"mjc:sideSites:indices = {sides}"),
    )


def fault(rule: str, words: str, *changes: Change) -> Fault:
    """Return which rule says what after changes of the routed finger."""
    return rule, words, changes


ERRORS: dict[str, Fault] = {
    "a place that is not listed": fault("tendon_path", "must count from 0 to 6",
        (SPATIAL, f"{SPATIAL}\nuniform int[] mjc:path:indices = [0, 1, 2, 3, 4, 5, 9]")),
    "too few sides": fault("tendon_path", "one entry per place",
        (SIDES, "mjc:sideSites:indices = [-1, 0]")),
    "a side that is not listed": fault("tendon_path", "must count mjc:sideSites from 0",
        (SIDES, SIDES.replace("0", "3"))),
    "a string that is divided": fault("tendon_path", "is one line",
        (SPATIAL, f"{SPATIAL}\nuniform double[] mjc:path:divisors = [2]")),
    "through a joint": fault("tendon_type", "runs through sites",
        *path_of(EXIT, "</finger_routed/joints/pip>", END)),
    "through nothing": fault("tendon_path", "is neither",
        *path_of(EXIT, "</finger_routed/base/no>", END)),
    "two lists that differ": fault("tendon_path", "the two differ",
        ("rel tendon:path = [", f"rel tendon:path = [{EXIT}, {END}]\n rel old:b = [")),
    "a shaft through sites": fault("tendon_type", "a shaft turns",
        ("tendon:direct = 0", "tendon:direct = 1")),
    "one end": fault("tendon_path", "has two ends", *path_of(EXIT)),
    "a pulley at the end": fault("tendon_path", "before and behind every pulley",
        *path_of(PULLEY, EXIT, FIRST, END)),
    "a pulley without a side": fault("pulley", "there is none", (SIDES, SIDES.replace("0", "-1"))),
    "a side on another link": fault("pulley", "on another link",
        (f"sideSites = {ABOVE}", f"sideSites = {FIRST}")),
    "a side inside the pulley": fault("pulley", "passes outside a pulley",
        (ABOVE_PLACE, "translate = (-0.014, 0, -0.0145)")),
    "two sites in one place": fault("tendon_path", "at one place", (A4_PLACE, A3_PLACE)),
    "nothing to move": fault("tendon_path", "on the same link", *path_of(EXIT, ABOVE)),
    "a site that runs into its pulley":
        fault("pulley", "stay outside it", (PULLEY_PLACE, "translate = (-0.0085, 0, -0.0165)"),
        (ABOVE_PLACE, "translate = (-0.0085, 0, -0.0105)")),
}  # fmt: skip
WARNINGS: dict[str, Fault] = {
    "a string that changes sides": fault(
        "pulley",
        "changes sides within the range",
        (ABOVE_PLACE, "translate = (-0.0225, 0, -0.0165)"),
    ),
    "a site ten times as far": fault(
        "tendon_path",
        "flexor_a4 of middle_phalanx lies in",
        (A4_PLACE, "translate = (0.2, 0, -0.06)"),
    ),
    "an arm that changes its sign": fault(
        "moment_arm_sign",
        "about mcp its moment arm goes from",
        ("translate = (0.012, 0, -0.0085)", "translate = (0.012, 0, 0.006)"),
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_a_broken_route_has_a_named_error(case: str, tmp_path: Path) -> None:
    """The check names the rule and says how to mend it; what cannot be read is refused."""
    rule, said, changes = ERRORS[case]
    path = write_changed(tmp_path, "finger_routed", *changes)
    found = [f for f in check_asset(path) if f.severity == "error"]
    assert [f.rule for f in found] == [rule], found
    assert said in found[0].message
    assert found[0].prim.endswith("/flexor")
    assert found[0].remedy


@pytest.mark.parametrize("case", WARNINGS)
def test_a_doubtful_route_has_a_named_warning(case: str, tmp_path: Path) -> None:
    """It still loads, and the check names the rule."""
    rule, said, changes = WARNINGS[case]
    path = write_changed(tmp_path, "finger_routed", *changes)
    found = [f for f in check_asset(path) if f.severity == "warning"]
    assert rule in [f.rule for f in found], found
    assert any(said in f.message for f in found), found
    load_mechanism(path)


def test_a_string_over_two_fingers_has_a_named_warning(tmp_path: Path) -> None:
    """It is legal to let one string bend two chains, and seldom meant."""
    own, other = (f"</hand/{name}/distal_phalanx/flexor_end>" for name in ("index", "middle"))
    path = write_changed(tmp_path, "hand", (own, other))
    found = [f for f in stage_findings(open_stage(path)) if f.rule == "tendon_path"]
    assert found[0].severity == "warning"
    assert "on another branch" in found[0].message
