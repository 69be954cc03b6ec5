"""Exams ask what their plan says, fairly, and their truths can be read and judged."""

import json
from collections import Counter
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from lab.exams.draw import main
from lab.exams.exam_draws import NEEDS_FINGER, ExamPlan, are_alike, on_one_bench, recipes
from tendon_lab.exam.exam_score import judge
from tendon_lab.exam.run_exam import read_truths
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tests.planted.sets.draws import EFFECTS, OUTSIDE


def test_every_cause_comes_up_as_often_as_any_other() -> None:
    """Singles and outside causes take turns; half the cases are singles."""
    drawn = list(recipes(ExamPlan(cases=300)))
    assert len({recipe.seed for recipe in drawn}) == 300
    singles = Counter(r.effects[0] for r in drawn if len(r.effects) == 1)
    effects = [singles[name] for name in EFFECTS]
    outside = [singles[name] for name in OUTSIDE]
    assert min(effects) >= 165 // len(EFFECTS) >= 3
    assert max(effects) - min(effects) <= 1
    assert max(outside) - min(outside) <= 1
    assert sum(not r.effects for r in drawn) == 45
    assert sum(effects) == 165


def test_pairs_are_alike_as_often_as_asked_for() -> None:
    """A quarter imitate each other, the others do not; most are from different sides."""
    drawn = [r.effects for r in recipes(ExamPlan(cases=200, families=("pair",)))]
    assert np.mean([are_alike(pair) for pair in drawn]) == pytest.approx(0.25, abs=0.09)
    assert len(set(drawn)) > 120
    alone = ExamPlan(families=("pair",), effects=("load_cell_lag", "load_cell_delay"))
    with pytest.raises(ValueError, match="told apart"):
        list(recipes(replace(alone, alike_share=0.0)))
    assert {r.effects for r in recipes(replace(alone, alike_share=1.0))} == {alone.effects}


def test_every_pair_that_one_bench_shows_can_come_up() -> None:
    """Left out are only those of a play in a shaft with what needs a string or a spring."""
    pairs = list(combinations(EFFECTS, 2))
    left_out = [pair for pair in pairs if not on_one_bench(*pair)]
    assert (len(pairs), len(left_out)) == (861, 31)
    assert all("backlash" in pair for pair in left_out)
    drawn = {r.effects: r.mix for r in recipes(ExamPlan(cases=800, families=("pair",)))}
    assert {mix for pair, mix in drawn.items() if "backlash" in pair} == {"P"}
    assert "P" not in {mix for pair, mix in drawn.items() if "backlash" not in pair}


def test_what_one_spring_cannot_show_is_mostly_shown_to_the_finger() -> None:
    """Five in six on a mix with the finger, and those of the sixth that fall there too."""
    plan = ExamPlan(cases=200, families=("single",), effects=tuple(NEEDS_FINGER))
    mixes = Counter(r.mix for r in recipes(plan))
    assert mixes["A"] + mixes["F"] > 180
    assert set(mixes) == {"A", "F", "S", "W"}


def test_circumstances_come_as_often_as_asked_for() -> None:
    """Slow cells and gaps belong to the cases whose friction the model knows."""
    plan = ExamPlan(cases=300, known_friction=0.4, cell_rate_share=0.5, weak_share=0.2)
    drawn = list(recipes(plan))
    known = [r for r in drawn if r.known_friction]
    assert len(known) / 300 == pytest.approx(0.4, abs=0.08)  # three deviations
    assert sum(r.cell_rate == 20.0 for r in known) / len(known) == pytest.approx(0.5, abs=0.14)
    assert not [r for r in drawn if not r.known_friction and (r.cell_rate or r.gaps)]
    assert sum(r.size < 1.0 for r in drawn) / 300 == pytest.approx(0.2, abs=0.07)
    assert {r.noise_colour for r in drawn} == {0.0, 0.6, 0.9}
    assert list(recipes(plan)) == drawn
    assert list(recipes(replace(plan, seed=1))) != drawn


def test_an_exam_can_be_read_and_judged(tmp_path: Path) -> None:
    """Folders and truths fit together, and a truth that answers itself is right."""
    out = tmp_path / "exam"
    main([str(out), "--cases", "4", "--seed", "7", "--known-friction", "0.5", "--prefix", "c"])
    truths = read_truths(out)
    assert [truth.id for truth in truths] == ["c001", "c002", "c003", "c004"]
    assert {truth.family for truth in truths} >= {"single"}
    for truth in truths:
        told = json.loads((out / "truth" / f"{truth.id}.json").read_text())
        known = load_model(out / truth.id / "model.toml").effects
        assert [effect["name"] for effect in told["known_effects"]] == [e.name for e in known]
        assert len(load_dataset(out / truth.id).test) == 3
        assert told["oracle"]["true"]["theta_rmse"] < 0.6e-3
        if truth.family != "outside":
            assert judge(truth, perfect_answer(told)).right


def perfect_answer(told: dict) -> dict:
    """What a diagnosis would say that knew the truth."""
    effects = [
        {
            "name": effect["name"],
            "indistinguishable_from": [],
            "parameters": {
                name: {"value": value, "ci95": [value, value]}
                for name, value in effect["parameters"].items()
            },
        }
        for effect in told["effects"]
    ]
    verdict = "explained" if effects else "no_gap"
    return {"verdict": verdict, "effects": effects, "wall_time_s": 1.0}
