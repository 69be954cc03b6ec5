"""The strict score of benches with many faults: what a name needs to be deserved."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from examples.studies.unit_faults import LATE, MENDS
from examples.studies.unit_score import Mark, leaves_null, mark, summary
from tendon_hardware.virtual_bench.emulation.truth import write_plant_file
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_hardware.virtual_bench.physics.wear import worn

TRUTH = {"tendon_slack": [{"length": 2e-3}], "load_dependent_friction": [{"coefficient": 0.4}]}
FAULTS = {
    "tendon_slack": {"theta": 0.5, "force": 0.0},
    "load_dependent_friction gear_load_friction": {"theta": 0.1, "force": 0.02},
    "voltage_sag": {"theta": 0.05, "force": 0.0},
}


def cause(name: str, number: str, interval: tuple[float, float], **more: Any) -> dict[str, Any]:
    """Return an entry of ``effects`` with one number, whose null is zero unless given."""
    null = more.pop("null", 0.0)
    estimate = {"value": sum(interval) / 2.0, "ci95": list(interval), "unit": "1", "null": null}
    return {"name": name, "parameters": {number: estimate}, "indistinguishable_from": []} | more


def scored(*effects: dict[str, Any], suspected: tuple[dict[str, Any], ...] = ()) -> Mark:
    """Score an answer whose squared error was 1 rad2 and 1 N2 above the noise."""
    answer = {
        "verdict": "explained",
        "effects": list(effects),
        "suspected": list(suspected),
        "noise_floor": {"theta": 0.0, "force": 0.0},
        "baseline": {"theta_rmse": 1.0, "force_rmse": 1.0},
        "extended": {"theta_rmse": 0.1, "force_rmse": 0.0},
    }
    return mark(7, answer, TRUTH, FAULTS, {"diagnose": 60.0})


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        (cause("tendon_slack", "length", (1e-3, 3e-3)), None),
        (cause("tendon_slack", "length", (0.0, 3e-3)), "leaves_null"),
        (cause("tendon_slack", "length", (3e-3, 4e-3)), "holds_truth"),
        (cause("backlash", "width", (0.1, 0.2)), "in_plant"),
        (cause("backlash", "width", (0.1, 0.2), indistinguishable_from=["tendon_slack"]), None),
        (cause("backlash", "width", (0.1, 0.2),
               indistinguishable_from=["deadband", "position_offset", "tendon_slack"]), "in_plant"),
        (cause("gear_load_friction", "coefficient", (0.1, 0.2)), None),
    ],
)  # fmt: skip
def test_a_name_is_deserved_by_plant_null_and_numbers(
    given: dict[str, Any], fault: str | None
) -> None:
    """It fails by the one thing that is wrong with it; a fourth classmate is not heard."""
    (name,) = scored(given).named
    failed = [k for k in ("in_plant", "leaves_null", "holds_truth") if not getattr(name, k)]
    assert failed == ([] if fault is None else [fault])
    assert name.deserved == (fault is None)


def test_a_rigid_string_is_the_null_of_its_stiffness_and_a_shape_has_none() -> None:
    """An infinite null stands as the end of the range; only sizes count in a law of several."""
    assert not leaves_null({"stiffness": {"ci95": [5e3, 1e6], "null": 1e6}})
    assert leaves_null({"stiffness": {"ci95": [5e3, 9e5], "null": 1e6}})
    law = {
        "coulomb_force": {"ci95": [0.0, 2.0], "null": 0.0},
        "static_force": {"ci95": [1.0, 2.0], "null": 0.0},
        "stribeck_velocity": {"ci95": [0.1, 2.0], "null": None},
    }
    assert not leaves_null(law)
    assert leaves_null(law | {"coulomb_force": {"ci95": [0.5, 2.0], "null": 0.0}})


def test_what_matters_is_worth_a_tenth_and_suspects_count_apart() -> None:
    """Slack is worth 0.25; gear 0.06 and sag 0.025 of the mean share are too little."""
    slack = cause("tendon_slack", "length", (1e-3, 3e-3), probability=0.95)
    wrong = cause("deadband", "width", (0.0, 1.0), probability=0.9)
    found = scored(wrong, suspected=(slack,))
    assert found.material == {"tendon_slack": pytest.approx(0.25)}
    assert found.gone == pytest.approx(0.995)
    total = summary([found, replace(found, named=found.suspected, suspected=())])
    assert total["material_faults_named"]["hits"] == 1
    assert total["with_suspected"]["material_faults"]["hits"] == 2
    assert total["sure_names_deserved"]["hits"] == 1
    assert total["sure_names_deserved"]["of"] == 2
    assert total["deserved_a_unit"] == 0.5


@pytest.mark.parametrize("bench", ["finger", "spring_weak"])
def test_each_fault_that_is_mended_is_one_that_the_plant_file_tells(
    bench: str, tmp_path: Path
) -> None:
    """A mend changes the unit, and its first name is in the file; a calibrated cell has no gain."""
    unit = worn(draw_unit(bench, 40), "planted")
    write_plant_file(tmp_path / "plant.toml", unit)
    table = tomllib.loads((tmp_path / "plant.toml").read_text(encoding="utf-8"))
    told = {effect["name"] for effect in table["effects"]}
    assert LATE in told
    for names, mend in MENDS.items():
        assert (mend(unit) != unit) == (names[0] in told), names
