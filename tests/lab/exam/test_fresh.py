"""The exam on fresh seeds asks what it says, goes on, and its second plant is what its laws say."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.exams import fresh
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
from tendon_lab.exam.truth_file import read_truth
from tendon_newton.data.dataset import load_dataset
from tendon_newton.scheduler import JobOptions
from tests.lab.exam.made_up_exam import answer


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


def test_an_exam_that_broke_off_draws_and_diagnoses_what_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
