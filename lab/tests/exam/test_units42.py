"""Faults of the whole catalogue are drawn, planted and told beside a bench's imperfections."""

import tomllib
from pathlib import Path

import pytest

from lab.exams import rich, units42
from lab.exams.exam_draws import are_alike
from lab.exams.oracle import asked
from tendon_hardware.virtual_bench.emulation.truth import write_plant_file
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.data.dataset import load_dataset
from tests.planted.generator import Recipe, make_dataset
from tests.planted.sets.draws import EFFECTS, MIX_OF


def test_all_of_the_catalogue_is_asked_for_but_play() -> None:
    """Three faults that do not imitate each other; half of the sets are virtual units."""
    drawn = [units42.faults_of(number) for number in range(400)]
    assert {name for names in drawn[1::2] for name in names} == set(EFFECTS) - set(MIX_OF)
    assert {name for names in drawn[::2] for name in names} == set(units42.VIRTUAL)
    assert all(len(set(names)) == units42.FAULTS for names in drawn)
    pairs = [(a, b) for names in drawn for a in names for b in names if a != b]
    assert not any(map(are_alike, pairs))
    recipe = units42.recipe_of(1)
    assert len({*recipe.effects, *recipe.small}) == units42.FAULTS + units42.SMALL


@pytest.mark.parametrize("name", units42.VIRTUAL)
def test_a_fault_of_a_virtual_unit_is_there_and_told(name: str, tmp_path: Path) -> None:
    """It changes a unit of some bench, whose file names it."""
    told, changed = set[str](), 0
    for bench in ("finger", "spring_weak"):
        unit = draw_unit(bench, 7)
        faulty = units42.planted_unit((name,), unit, units42.random.Random(0))
        changed += faulty != unit
        write_plant_file(tmp_path / "plant.toml", faulty)
        table = tomllib.loads((tmp_path / "plant.toml").read_text(encoding="utf-8"))
        told |= {effect["name"] for effect in table["effects"]}
    assert changed
    assert name in told


def test_small_effects_are_planted_beside_the_fault_and_told(tmp_path: Path) -> None:
    """A tenth of their size, unknown to the model, and no fault of the set."""
    recipe = Recipe(effects=("gain_error",), mix="W", seed=3, duration=(1.0, 1.2))
    plain = make_dataset(tmp_path / "plain", recipe)
    told = make_dataset(tmp_path / "small", Recipe(**{**vars(recipe), "small": ("tendon_slack",)}))
    assert told.effects == ("gain_error",)
    assert 1e-4 <= told.parameters["tendon_slack"]["length"] <= 3e-4
    assert set(plain.parameters) == {"gain_error"}
    assert told.true != told.nominal
    assert len(load_dataset(tmp_path / "small").train) == 5


def test_an_oracle_is_asked_for_the_faults_that_were_missed(tmp_path: Path, monkeypatch) -> None:
    """Of three faults one is found; all effects are told with the first bench's numbers."""
    truth = {"effects": {"deadband": [{"width": 0.1}, {"width": 0.2}], "backlash": [{}]},
             "planted": ["deadband", "backlash"]}  # fmt: skip
    monkeypatch.setattr(units42, "set_of", lambda *_: truth)
    monkeypatch.setattr(units42, "take", lambda _: (None, ("backlash",)))
    effects, lost = asked(tmp_path, units42.name_of(4), {})
    assert (effects, lost) == ({"deadband": {"width": 0.1}, "backlash": {}}, ("deadband",))
    monkeypatch.setattr(rich, "set_of", lambda *_: {"effects": {}, "planted": []})
    monkeypatch.setattr(rich, "take", lambda _: (None, ()))
    assert asked(tmp_path, rich.name_of(4), {}) == ({}, ())
