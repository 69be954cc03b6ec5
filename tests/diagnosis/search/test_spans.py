"""Long data are searched and decided on parts that every bench and gain has a share in."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.search.decide.extent import (
    MOST_DECIDING,
    MOST_SECONDS,
    MOST_SPANS,
    SEARCHED_SECONDS,
    beginnings,
    deciding,
)
from tests.effect_bench import commanded


def runs(count: int, seconds: float, bench: str) -> list[Recording]:
    """Recordings of one bench."""
    return [commanded(np.zeros(int(80 * seconds)), bench) for _ in range(count)]


def test_little_data_decide_as_they_are() -> None:
    """Five recordings of 15 s: the same objects, nothing is cut."""
    data = runs(5, 15.0, "spring_weak")
    assert all(own is other for own, other in zip(deciding(data), data, strict=True))


def test_hours_are_decided_on_minutes_of_every_bench() -> None:
    """36 minutes on three benches: 80 s decide, 40 s are searched."""
    benches = ("finger", "spring_weak", "spring_strong")
    data = [run for bench in benches for run in runs(16, 45.0, bench)]
    chosen, first = deciding(data), beginnings(data)
    assert {r.bench for r in chosen} == {r.bench for r in first} == set(benches)
    assert len(chosen) <= MOST_DECIDING
    assert len(first) <= MOST_SPANS
    assert sum(r.duration for r in chosen) == pytest.approx(MOST_SECONDS, rel=0.05)
    assert sum(r.duration for r in first) == pytest.approx(SEARCHED_SECONDS, rel=0.05)


def test_one_long_run_keeps_what_it_may() -> None:
    """Ten minutes of one recording: its beginning decides."""
    (chosen,) = deciding(runs(1, 600.0, "spring_weak"))
    assert chosen.duration == pytest.approx(MOST_SECONDS, abs=0.1)


def test_what_only_follows_its_commands_is_taken_whole() -> None:
    """Ten minutes of it cost as little as seconds of a finger."""
    data = runs(4, 150.0, "pendulum")
    assert beginnings(data, whole=True) == deciding(data, whole=True) == tuple(data)


def test_the_same_motions_at_each_gain_are_all_looked_at() -> None:
    """Five motions, the same at each of eight gains: no motion is left out of what chooses sets."""
    data = [
        replace(run, name=f"motion {i}", actuator_overrides={"duty_per_rad": float(gain)})
        for gain in range(1, 9)
        for i, run in enumerate(runs(5, 6.0, "pendulum"))
    ]
    first = beginnings(data)
    assert len({r.actuator_overrides["duty_per_rad"] for r in first}) == 8
    assert len({r.name for r in first}) == 5
