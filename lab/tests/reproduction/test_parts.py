"""What a reproduction is made of: its plan, its benches and their causes."""

import numpy as np
import pytest

from tendon_hardware.collection.excitation_plan import find_plan
from tendon_lab.reproduction.experiment_plan import FURTHER_RUNS, thinned
from tendon_lab.reproduction.settings import find_settings
from tendon_lab.reproduction.steps.diagnosis_stage import scope_text, sources
from tendon_lab.reproduction.unit import Unit, interleaved, kind_of, representative
from tendon_newton.errors import InvalidDataset


def test_a_bench_without_causes_of_its_own_takes_the_usual_ones() -> None:
    """Units of one product; one diagnosis serves all, and without any each is its own."""
    found = [
        [{"effects": [{"name": name} for name in names]}]
        for names in (
            (),
            ("backlash",),
            ("coulomb_friction", "deadband"),
            ("deadband", "coulomb_friction"),
            (),
        )
    ]
    assert sources(found, 5) == [2, 1, 2, 3, 2]
    assert sources(found[2:3], 3) == [0, 0, 0]
    assert sources([], 2) == [0, 0]
    assert sources([found[0], found[4]], 2) == [0, 1]


def test_a_thinned_plan_keeps_every_kind_and_every_test() -> None:
    """One run of each kind stays, and all test runs."""
    plan = find_plan("paper")
    thin = thinned(plan, 1)
    assert {run.name.rsplit("_", 1)[0] for run in thin} == {
        run.name.rsplit("_", 1)[0] for run in plan
    }
    assert [run for run in thin if run.split == "test"] == [r for r in plan if r.split == "test"]
    assert len([run for run in thin if run.split == "train"]) == 17
    assert thinned(plan, None) == plan


def test_the_open_sine_is_the_papers_about_another_centre() -> None:
    """Amplitude pi/2 at 0.5 Hz about 0.2 rad: the command is negative for a part of a period."""
    command = FURTHER_RUNS[0].command(seed=0, rate=80.0)
    assert len(command) == 12 * 80
    assert command[0] == pytest.approx(0.2)
    assert np.ptp(command) == pytest.approx(np.pi, rel=1e-3)  # rows miss the peaks a little
    np.testing.assert_allclose(command[160:], command[:-160], atol=1e-12)  # two seconds later


def test_recordings_of_a_plan_and_of_experiments_are_one_bench(unit: Unit) -> None:
    """The sinusoid that dips below zero lies in another folder."""
    command = unit.find("finger", "open_sine").command
    assert float(command.min()) < -1.3
    assert len(unit.sha256) == 64


def test_a_missing_experiment_is_named(unit: Unit) -> None:
    """The message says what a recording must be called."""
    with pytest.raises(InvalidDataset, match="named finger_stairs_0"):
        unit.find("finger", "stairs")


def test_fits_of_physics_see_every_bench_and_nothing_blocked(unit: Unit) -> None:
    """One recording of each kind, and the steps to report on."""
    data = representative(unit, 3.0, kinds=2)
    assert [(r.bench, kind_of(r)) for r in data.train] == [
        (bench, kind)
        for bench in ("finger", "spring_weak", "spring_strong")
        for kind in ("random_steps", "sine")
    ]
    assert {r.bench for r in data.test} == {"finger", "spring_weak", "spring_strong"}
    kinds = [kind_of(r) for r in interleaved(r for r in data.train if r.bench == "finger")]
    assert kinds == ["random_steps", "sine"]


def test_causes_are_sought_in_a_part_of_what_their_numbers_are_fitted_to(unit: Unit) -> None:
    """A diagnosis sees no more than 4 s of some of the same recordings, 24 s in all."""
    for settings in (find_settings("quick"), find_settings("full")):
        sought = representative(unit, settings.diagnosis_seconds, settings.diagnosis_kinds).train
        fitted = representative(unit, settings.refit_seconds, settings.refit_kinds).train
        assert {r.name for r in sought} <= {r.name for r in fitted}
        assert max(r.duration for r in sought) <= 4.0
        assert 3 * settings.diagnosis_kinds * settings.diagnosis_seconds <= 24.0
        assert sum(r.duration for r in sought) < 0.8 * sum(r.duration for r in fitted)
        assert f"first {settings.refit_seconds:g} s" in scope_text(settings)
