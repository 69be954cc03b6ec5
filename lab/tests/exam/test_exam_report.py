"""An exam's figures count what they say, and what is scored is what was asked."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.exams import fresh, other_sets, rich
from lab.exams.other_plant import (
    BRISTLE,
    DRAWINGS,
    GAIN,
    NULLS,
    RADIUS,
    SETTLING,
    Array,
    logged,
    simulate,
)
from lab.exams.other_sets import OtherRecipe, make_other, other_recipes
from lab.studies.unit_faults import LATE, MENDS
from lab.studies.unit_score import Mark, leaves_null, mark, summary
from lab.tests.exam.made_up_exam import answer, marks, truth
from tendon_hardware.virtual_bench.emulation.truth import write_plant_file
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_hardware.virtual_bench.physics.wear import worn
from tendon_lab.exam.exam_rates import rates
from tendon_lab.exam.exam_score import judge
from tendon_lab.exam.truth_file import read_truth
from tendon_newton.data.dataset import load_dataset
from tendon_newton.scheduler import JobOptions


def test_the_figures_are_what_a_hand_counts() -> None:
    """Four singles, two pairs, two clean ones and two outside, each answered in its own way."""
    found = {rate.name: (rate.value, rate.cases) for rate in rates(marks())}
    assert found["single: true cause named first"] == (0.25, 4)
    assert found["single: true cause first or in its class"] == (0.5, 4)
    assert found["single: not confidently wrong"] == (0.75, 4)
    assert found["clean: no cause named"] == (0.5, 2)
    assert found["clean: verdict no_gap"] == (0.5, 2)
    assert found["outside: no wrong name"] == (1.0, 2)
    assert found["pair: both found"] == (0.5, 2)
    assert found["pair: nothing else named"] == (0.5, 2)
    error, count = found["parameters: relative error, median"]
    assert (error, count) == (pytest.approx(0.1), 4)
    assert found["parameters: 95 % interval holds the truth"] == (1.0, 4)
    assert found["held-out gain over the true model's, median"] == (pytest.approx(1.0), 6)
    assert found["peak memory [MiB]"] == (600.0, 10)


def test_many_causes_are_counted_one_by_one_and_weak_ones_apart() -> None:
    """Of three and two causes three are found, beside one that is not there."""
    told = [
        judge(
            truth("l", "many", "gain_error", "tendon_slack", "deadband"),
            answer("explained", ("gain_error",), ("tendon_slack",), ("obstruction",)),
        ),
        judge(truth("m", "many", "gain_error", "deadband"), answer("explained", ("gain_error",))),
        judge(truth("n", "single", "deadband", weak=True), answer("no_gap")),
    ]
    found = {rate.name: (rate.value, rate.cases) for rate in rates(told)}
    assert found["many: recall"] == (0.6, 5)
    assert found["many: precision"] == (0.75, 4)
    assert found["many: all found and nothing else"] == (0.0, 2)
    assert found["weak: silent"] == (1.0, 1)
    assert "single: true cause named first" not in found


def test_a_class_of_more_than_three_is_no_answer() -> None:
    """The true cause among three names counts; among four only the first name does."""
    true = truth("k", "single", "command_delay")
    three = ("actuator_lag", "viscous_friction", "command_delay")
    assert judge(true, answer("explained", three)).in_class
    four = judge(true, answer("explained", (*three, "load_cell_delay")))
    assert not four.in_class
    assert four.classes == (("actuator_lag",),)


def test_the_gain_is_measured_by_the_true_models() -> None:
    """All of it where the true error is reached; (1 - 0.25) / (1 - 0.01) of it at half the error.

    None where nothing is hidden, as there is nothing to gain.
    """
    gains = {mark.truth.id: mark.gain for mark in marks()}
    assert gains["a"] == pytest.approx(1.0)
    assert gains["b"] == pytest.approx(0.75 / 0.99)
    assert gains["d"] == pytest.approx(0.0)
    assert gains["g"] is None


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
def test_a_name_is_deserved_by_plant_null_and_numbers(given, fault) -> None:
    """It fails by the one thing that is wrong with it; a fourth classmate is not heard."""
    (name,) = scored(given).named
    failed = [k for k in ("in_plant", "leaves_null", "holds_truth") if not getattr(name, k)]
    assert failed == ([] if fault is None else [fault])
    assert name.deserved == (fault is None)


def test_a_rigid_string_is_the_null_of_its_stiffness_and_a_shape_has_none() -> None:
    """An infinite null stands as the end of the range; only sizes count in a law of several."""
    assert not leaves_null({"stiffness": {"ci95": [5e3, 1e6], "null": 1e6}})
    assert leaves_null({"stiffness": {"ci95": [5e3, 9e5], "null": 1e6}})
    guide = {"exponent": {"ci95": [0.1, 0.2], "null": 0.0}, "behind": {"ci95": [0, 1], "null": 0}}
    assert leaves_null(guide)  # where the guide sits gives the friction its form
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
def test_each_fault_that_is_mended_is_one_that_the_plant_file_tells(bench, tmp_path) -> None:
    """A mend changes the unit, and its first name is in the file; a calibrated cell has no gain."""
    unit = worn(draw_unit(bench, 40), "planted")
    write_plant_file(tmp_path / "plant.toml", unit)
    table = tomllib.loads((tmp_path / "plant.toml").read_text(encoding="utf-8"))
    told = {effect["name"] for effect in table["effects"]}
    assert LATE in told
    for names, mend in MENDS.items():
        assert (mend(unit) != unit) == (names[0] in told), names


def run(command: Array, **causes: float) -> tuple[Array, Array]:
    """Return angle and tension of the weak spring under commands (T, R), each with the causes."""
    own = {n: np.full(command.shape[1], causes.get(n, null)) for n, null in NULLS.items()}
    return simulate(DRAWINGS["spring_weak"], own, command)


def test_every_set_has_a_seed_of_its_own_that_nobody_used() -> None:
    """Sections draw from seeds apart, above all earlier exams."""
    makers = fresh.sets_of(fresh.SEED)
    seeds = [make.keywords["recipe"].seed for make in makers.values()]  # type: ignore[attr-defined]
    assert len(set(seeds)) == len(seeds) == 261
    assert min(seeds) == 300_000
    wanted = {name: plan.cases for name, plan in fresh.SECTIONS.items()} | {"other": 42}
    for section, count in wanted.items():
        assert sum(name.rstrip("0123456789") == section for name in makers) == count


def test_a_spring_stands_where_servo_and_spring_agree() -> None:
    """A held command of 3 rad: k x = gain (3 - x / r); viscous friction moves nothing."""
    angle, tension = run(np.full((8000, 1), 3.0), viscous=0.3)
    at = 3.0 * GAIN / (GAIN + 200.0 * RADIUS)
    assert angle[-1, 0] == pytest.approx(at, rel=1e-3)
    assert tension[-1, 0] == pytest.approx(200.0 * RADIUS * at, rel=1e-3)


def test_friction_turns_with_the_motion_within_its_bristles_travel() -> None:
    """Slow ramps up and down differ by twice the friction, but for where they turn."""
    goal = np.concatenate([np.linspace(1.0, 4.0, 15000), np.linspace(4.0, 1.0, 15000)])[:, None]
    angle, tension = run(goal, coulomb=1.2)
    lost = GAIN * (goal - angle) - tension
    assert lost[14000, 0] == pytest.approx(1.2, rel=0.01)
    assert lost[28000, 0] == pytest.approx(-1.2, rel=0.01)
    back = (angle[15000:].max() - angle[15000:, 0]) * RADIUS
    turned = int(np.searchsorted(np.maximum.accumulate(back), BRISTLE))
    # from bent one way to the other: 1 - 2 (1 - 1/e) of the friction after one travel
    assert lost[15000 + turned, 0] == pytest.approx(1.2 * (2.0 / np.e - 1.0), abs=0.1)


def test_a_late_cell_and_a_late_command_are_late() -> None:
    """The cell reads what was; a servo with a delay does then what another does now."""
    goal = np.repeat([1.0, 3.0], [20000, 10000])[:, None]
    now, late = (run(goal, delay=delay)[0][:, 0] for delay in (0.0, 0.05))
    assert np.abs(late[20500:] - now[20000:-500]).max() < 1e-6  # both have settled before
    tension = np.linspace(0.0, 4.0, 40000)
    one, other = (
        logged(np.random.default_rng(0), {**NULLS, "cell_delay": late}, tension, tension)[2]
        for late in (0.0, 0.1)
    )
    assert np.mean(one[20:] - other[20:]) == pytest.approx(0.1, abs=0.005)  # counts of 10 mN


def test_a_set_of_the_second_plant_can_be_read_and_tells_its_strength(tmp_path: Path) -> None:
    """What is planted moves the tested runs; without a cause nothing moves."""
    told = make_other(tmp_path / "a", recipe_of("load_cell_bias"))
    assert told["family"] == "single"
    bias = told["effects"][0]["parameters"]["offset"]
    assert told["strength"]["ratio"] == pytest.approx(abs(bias) / 0.05, rel=0.02)
    assert (len(load_dataset(tmp_path / "a").train), SETTLING) == (5, 1.5)
    assert {recipe.effects for recipe in other_recipes(1, 26, 0, 1)} >= {(), ("obstruction",)}


def recipe_of(*effects: str) -> OtherRecipe:
    """Return a set on sliders."""
    return OtherRecipe(effects=effects, seed=1, benches=("spring_weak", "spring_strong"))


def test_an_exam_that_broke_off_draws_and_diagnoses_what_is_left(tmp_path, monkeypatch) -> None:
    """What has an answer is neither drawn nor diagnosed again, and sums stand in one file."""
    drawn: list[str] = []

    def make(out: Path) -> dict[str, Any]:
        drawn.append(out.name)
        out.mkdir(parents=True)
        return {"family": "clean", "effects": []}

    def diagnosed(paths: tuple[Path, Path]) -> dict[str, Any]:
        fresh.write_json(paths[1].joinpath(fresh.ANSWER), stated)
        return stated

    stated = answer("no_gap") | {"schema": "diagnosis/1"}
    monkeypatch.setattr(fresh, "answer_one", diagnosed)
    monkeypatch.setattr(fresh, "read_answer", lambda path: stated if path.is_file() else None)
    makers = {"clean000": make, "clean001": make}
    for folder in ("clean000", "clean001"):
        (tmp_path / "answers" / folder).mkdir(parents=True)
    first = list(fresh.take(tmp_path, {"clean000": make}, JobOptions()))
    marks = [*first, *fresh.take(tmp_path, makers, JobOptions())]
    assert drawn == ["clean000", "clean001"]
    assert read_truth(fresh.truth_path(tmp_path, "clean001")).family == "clean"
    told = fresh.summary({mark.truth.id: mark for mark in marks}, 7)
    silent = told["sections"]["clean"]["clean: verdict no_gap"]
    assert (silent["value"], silent["cases"], told["wrong"]) == (1.0, 2, {})
    assert silent["at_least"] == pytest.approx(1.0 / (1.0 + 1.645**2 / 2.0))  # Wilson, all of two
    wrong = replace(marks[0], said=("deadband",), classes=(("deadband",),))
    assert fresh.summary({"clean000": wrong}, 7)["wrong"]


def test_a_rich_bench_tells_what_each_of_its_faults_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fourteen causes, each mended alone: the two that matter move more than the others' median."""
    monkeypatch.setattr(other_sets, "DURATION", 2.0)
    told = rich.set_of(tmp_path, 0)
    assert len(told["effects"]) == len(told["moves"]) == rich.IMPERFECTIONS + 2
    moves = {name: force / 0.1 + angle / 0.01 for name, (force, angle) in told["moves"].items()}
    assert min(moves[name] for name in told["planted"]) > np.median([*moves.values()]) > 0.0
    assert len(load_dataset(tmp_path / "sets" / "rich000").train) == other_sets.TRAIN
    assert rich.set_of(tmp_path, 0) == told
