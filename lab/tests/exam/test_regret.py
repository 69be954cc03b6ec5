"""All sets of a few laws beside an answer: what an answer misses is seen, and nothing else is."""

import tarfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.exams.regret.answers import regret_of, summary, unpacked
from lab.exams.regret.enumeration import Bench, bench_of
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.choice import Chooser
from tendon_newton.diagnosis.search.refit import refit, start_fits
from tendon_newton.diagnosis.search.small_sets import SIZE, all_sets
from tendon_newton.diagnosis.search.survey import survey
from tendon_newton.simulation.hosts.replay import replay, simulated_recording
from tests.effect_bench import commanded, steps_and_waves
from tests.physics.runs import ideal_model

PLANTED = {"command_delay": {"delay": 0.03}, "viscous_friction": {"coefficient": 1.2}}
NUMBERS = {"command_delay.delay": 0.03, "viscous_friction.coefficient": 1.2}
LAWS = (*PLANTED, "actuator_lag", "gain_error")
CABLE = ("routing_friction",)


def log(seed: int, bench: str = "spring_weak", **planted: dict[str, float]) -> Recording:
    """What a bench logs; by default a weak spring's whose servo hears late and runs in grease."""
    rng = np.random.default_rng(seed)
    asked = commanded((0.6 + 0.2 * seed) * steps_and_waves(), bench=bench)
    asked = replace(asked, force=np.zeros((160, 1)))
    (out,) = replay([asked], ideal_model(**(planted or PLANTED)), time_step=1.0e-3)
    found = simulated_recording(asked, out)
    noise = rng.normal(0.0, 5.0e-4, found.motor_position.shape)
    return replace(found, name=f"log_{seed}", motor_position=found.motor_position + noise)


@pytest.fixture
def bench() -> Bench:
    """Two such logs, as a decision that named nothing sees them."""
    return bench_of([log(0), log(1)], ideal_model(), ())


@pytest.fixture(autouse=True)
def few_laws(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four laws in place of seventeen."""
    monkeypatch.setattr("lab.exams.regret.answers.LAWS", LAWS)


def test_the_right_set_has_no_regret_and_half_of_it_has(bench: Bench) -> None:
    """Named both, nothing is better by half a price; named one of them, the other is worth many."""
    right = regret_of(bench, tuple(PLANTED), NUMBERS, best=2)
    assert right["regret"] < 0.5
    assert set(right["wins"]["causes"]) == set(PLANTED)
    half = regret_of(bench, ("viscous_friction",), NUMBERS, best=2)
    assert half["regret"] > 5.0
    assert set(half["wins"]["causes"]) == set(PLANTED)
    told = [{**each, "name": "", "kind": "drawn", "verdict": ""} for each in (right, half)]
    assert summary(told)["drawn"]["above_a_price"] == 1


def test_an_answer_has_the_lines_of_its_benches() -> None:
    """Each further bench has a string of its own, and the answer says what it found of it."""
    logs = [
        log(seed, bench, routing_friction={"exponent": exponent, "behind": 0.0})
        for seed, (bench, exponent) in enumerate({"spring_weak": 0.2, "finger": 0.24}.items())
    ]
    numbers = {"routing_friction.exponent": 0.2, "routing_friction.behind": 0.0}
    of_line = {"bench.finger.routing_friction": 1.2}
    half, right = (
        regret_of(bench_of(logs, ideal_model(), CABLE), CABLE, told, best=1)["regret"]
        for told in (numbers, {**numbers, **of_line})
    )
    assert right < 0.5 < half


def test_all_sets_are_scored_once(bench: Bench) -> None:
    """Of four laws that exclude nothing there are 4 + 6 + 4 sets, around a set with one of them."""
    pool, (viscous,) = bench.pool, bench.pool.worlds.study.table.columns("viscous_friction")
    begun = (("viscous_friction",), {**bench.start, viscous: 1.2})
    fit = refit(pool.worlds, start_fits(pool.worlds, [begun], pool.floors), pool.floors,
                iterations=1)[0]  # fmt: skip
    chooser = Chooser(survey(pool.worlds, fit, LAWS, pool.floors, coarse=True), pool.price, SIZE)
    sets = [frozenset(chooser.names(trial)) for trial in all_sets(chooser, LAWS)]
    assert len(sets) == len(set(sets)) == 14


def test_logs_are_found_in_the_folder_of_their_archive(tmp_path: Path) -> None:
    """A published archive has its logs in a folder: they were looked for beside that."""
    log = tmp_path / "logs" / "one.json"
    log.parent.mkdir()
    log.write_text("{}")
    with tarfile.open(tmp_path / "logs.tar.xz", "w:xz") as archive:
        archive.add(log, "logs/one.json")
    for _ in range(2):
        found = unpacked(tmp_path / "logs.tar.xz", tmp_path / "out")
        assert [p.name for p in found.iterdir()] == ["one.json"]
