"""A constant answer reaches what a hand counts: everything where sets are alike, little else."""

from math import comb

import pytest

from lab.exams import fresh
from lab.tests.exam.made_up_exam import answer, truth
from tendon_lab.exam.constant_answers import reached
from tendon_lab.exam.exam_rates import rates
from tendon_lab.exam.exam_score import Mark, judge
from tendon_newton.effects import EFFECTS

FIRST = "single: true cause first or in its class"


def silent(*names: str) -> Mark:
    """An answer of nothing to a set with some causes."""
    family = ("clean", "single", "pair")[len(names)]
    return judge(truth("t", family, *names), answer("no_gap"))


def constant(marks: list[Mark], **others: list[tuple[str, ...]]) -> dict[str, tuple[float, ...]]:
    """What a fixed answer and random ones reach, by rate."""
    found = rates(marks, others or None)  # type: ignore[arg-type]
    return {r.name: (r.fixed, r.random) for r in found if r.fixed is not None}  # type: ignore[misc]


def test_a_class_of_three_of_the_catalogue_is_right_of_three() -> None:
    """Every effect once: a fixed class of three is right of three sets, a random one as often."""
    marks = [silent(name) for name in EFFECTS]
    fixed, random = constant(marks)[FIRST]
    assert fixed == pytest.approx(3 / len(EFFECTS))
    assert random == pytest.approx(3 / len(EFFECTS), abs=0.02)  # 50 draws of each of 42


def test_sets_that_are_alike_test_no_name() -> None:
    """All sets have the same two causes: the answer that opens no file finds both in each."""
    told = constant([silent("deadband", "tendon_slack")] * 5)
    assert told["pair: both found"][0] == 1.0
    assert told["pair: both found"][1] < 0.1


def test_the_fixed_answer_is_chosen_on_other_draws_and_is_silent_where_nothing_is_wrong() -> None:
    """What stood elsewhere is said here, true or not; of clean sets nothing is said."""
    elsewhere = {"single": [("deadband",), ("deadband",), ("backlash",)], "clean": [()]}
    told = constant([silent("backlash"), silent("gain_error"), silent()], **elsewhere)
    assert told["single: true cause named first"][0] == 0.0
    assert told["clean: verdict no_gap"] == (1.0, 0.0)


def test_sections_draw_elsewhere_without_simulating() -> None:
    """Another seed, the same plan: as many singles, and what is outside the catalogue apart."""
    drawn = fresh.drawn_elsewhere(fresh.SEED)
    assert len(drawn["single"]["single"]) == fresh.SECTIONS["single"].cases
    assert set(drawn["outside"]) == {"outside"}
    assert set(drawn["other"]) == {"single", "pair", "clean"}


def test_three_names_chosen_on_other_benches_are_held_against_each() -> None:
    """Two benches have one fault that matters, the third another; half of all causes is there."""
    half = [*EFFECTS][: len(EFFECTS) // 2]
    faults = [["stribeck_friction"], ["stribeck_friction"], ["deadband"]]
    found = reached([half] * 3, faults)
    assert found["names"] == ["stribeck_friction", "deadband"]
    assert found["faults"]["fixed"] == pytest.approx(2 / 3)
    assert found["in_plant"]["random"] == pytest.approx(len(half) / len(EFFECTS))
    three = comb(len(EFFECTS) - len(half), 3) / comb(len(EFFECTS), 3)
    assert found["in_plant"]["class"] == pytest.approx(1.0 - three)
