"""No engine is timed that does not compute the motion."""

from functools import partial

import numpy as np
import pytest

from lab.benchmarks import mechanics
from lab.benchmarks.engines_timed import soundness
from lab.benchmarks.engines_timed.engines import JOINT_FRICTION, FeatherstoneEngine, TendonEngine
from lab.benchmarks.engines_timed.native_mujoco import PlainMujocoEngine
from lab.benchmarks.engines_timed.soundness import ROWS, UnsoundEngine, judge, largest_sound, path

WORLDS = 8


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    """Return the path of fingers that rub, shape (T, W, J)."""
    return path(TendonEngine(WORLDS, 2.0e-4, "float64"))


def test_the_check_reaches_a_stop_and_sticks(reference: np.ndarray) -> None:
    """Otherwise it would not see an engine whose stops or friction fail."""
    (_, (_, stop)) = soundness.finger_limits()
    assert reference.shape == (ROWS, WORLDS, 2)
    assert reference[:, :, 1].max() > stop
    assert (np.abs(np.diff(reference, axis=0)) < 1.0e-6).mean() > 0.1


def test_a_diverging_engine_is_refused_and_never_timed(
    reference: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Featherstone throws the links through their stops at 2 ms, as it is known to."""
    monkeypatch.setattr(soundness, "LADDER", (26,))
    monkeypatch.setattr(mechanics, "best_time", lambda *_: pytest.fail("it was timed"))
    make = partial(FeatherstoneEngine, friction=0.0)
    with pytest.raises(UnsoundEngine, match=r"8 worlds escaped"):
        mechanics.timed_when_sound("SolverFeatherstone", WORLDS, make, reference)


def test_an_engine_that_forgets_friction_is_refused(
    reference: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stays finite, and is 0.07 rad off."""
    monkeypatch.setattr(soundness, "LADDER", (50, 100))
    with pytest.raises(UnsoundEngine, match=r"1 ms: 0\.0\d+ rad, 0 worlds escaped; 0\.5 ms"):
        largest_sound("without friction", partial(TendonEngine, WORLDS, friction=0.0), reference)


def test_one_world_that_escapes_is_enough(reference: np.ndarray) -> None:
    """Neither NaN nor a joint far beyond its stop is averaged away."""
    for value in (np.nan, np.inf, -1.0e14, 3.0):
        found = reference.copy()
        found[ROWS // 2, 3, 1] = value
        verdict = judge(found, reference)
        assert verdict.escaped == 1
        assert not verdict.sound


def test_the_longest_sound_step_is_taken(
    reference: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shorter ones are not tried, and MuJoCo in C has the same motion as our solver."""
    monkeypatch.setattr(soundness, "LADDER", (6, 64, 100))
    make = partial(PlainMujocoEngine, WORLDS, friction=JOINT_FRICTION)
    engine, substeps, verdict = largest_sound("MuJoCo", make, reference)
    assert substeps == engine.substeps == 64
    assert verdict.sound
    assert verdict.error > 1.0e-3  # another engine, and not our own
