"""Rivals of the study of cables know what they may: the past, and the runs that are fitted."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lab.studies.cable_tool import rivals
from lab.studies.cable_tool.__main__ import BY_LOAD, SPLITS, START
from lab.studies.cable_tool.runs import Run
from tendon_newton.data.recording import Recording
from tests.physics.runs import led

FREQUENCIES, LOADS = (0.1, 0.2, 0.3, 0.4, 0.5), 0.1 * np.arange(1, 11)


def path_of(rows: int = 150) -> Recording:
    """A shaft led along a sine for three seconds."""
    angle = np.sin(0.05 * np.arange(rows))
    return led(angle, 0.1 + 0.0 * angle, rate=50.0)


def run_of(setting: str, frequency: float, load: float) -> Run:
    """A run of some conditions."""
    named = replace(path_of(), name=f"{setting}_{frequency:g}_{load:.1f}")
    return Run(recording=named, setting=setting, stop=0, frequency=frequency, load=load)


RUNS = [
    run_of(setting, frequency, float(load))
    for setting in ("4", "Pitch_1", "Pitch_3")
    for frequency in FREQUENCIES
    for load in LOADS
]


def test_a_network_sees_no_future() -> None:
    """Whatever comes later changes nothing of what it sees of a row."""
    whole, now = path_of(), 90
    later = whole.motor_position.copy()
    later[now + 1 :] += 5.0
    before, after = (rivals.inputs_of(r) for r in (whole, replace(whole, motor_position=later)))
    assert np.array_equal(before[: now + 1], after[: now + 1])
    assert not np.array_equal(before[now + 1 :], after[now + 1 :])


@pytest.mark.parametrize("name", SPLITS)
def test_no_condition_is_both_fitted_and_tested(name: str) -> None:
    """Runs of a split share no setting, or neither load nor frequency."""
    split = SPLITS[name]
    train, test = ([run for run in RUNS if kind(run)] for kind in (split.train, split.test))
    assert train
    assert test
    for a in train:
        for b in test:
            assert a.setting != b.setting or (a.load != b.load and a.frequency != b.frequency)


def test_a_law_is_fitted_to_the_runs_that_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first study is what is fitted, and has no run that is tested."""
    seen: list[list[str]] = []

    def study(recordings: Sequence[Recording], *_: Any, **__: Any) -> Any:
        seen.append([recording.name for recording in recordings])
        return SimpleNamespace(residuals=lambda *_: [])

    monkeypatch.setattr(rivals, "Study", study)
    monkeypatch.setattr(rivals, "SearchWorlds", lambda own: own)
    fit: Any = SimpleNamespace(columns=(), place=())
    monkeypatch.setattr(rivals, "fit_set_anew", lambda *_: fit)
    rivals.fitted_law(BY_LOAD, START, RUNS[:2], RUNS[2:4])
    assert seen == [[run.recording.name for run in own] for own in (RUNS[:2], RUNS[2:4])]
