"""Parts of a bench's recordings that the study of less data learns from."""

from __future__ import annotations

import pytest

from examples.studies.less_data import free_only, shortened
from tendon_lab.reproduction.unit import Unit, is_blocked


def test_shortened_data_keeps_every_bench_in_proportion(unit: Unit) -> None:
    """Half of the minutes are half of each bench's, from two recordings or more."""
    whole = unit.dataset
    minutes = sum(r.duration for r in whole.train) / 60.0
    half = shortened(whole, 0.5 * minutes)
    for bench in ("finger", "spring_weak", "spring_strong"):
        own, all_of_it = ([r for r in part.train if r.bench == bench] for part in (half, whole))
        assert len(own) >= 2
        share = sum(r.duration for r in own) / sum(r.duration for r in all_of_it)
        assert share == pytest.approx(0.5, abs=0.02)  # a row each
    assert shortened(whole, 2.0 * minutes) is whole


def test_free_motion_has_nothing_in_the_way(unit: Unit) -> None:
    """Blocked recordings are left out, by their names, and no others."""
    free = free_only(unit.dataset).train
    assert any(is_blocked(r) for r in unit.dataset.train)
    assert free == tuple(r for r in unit.dataset.train if "tape_roll" not in r.name)
