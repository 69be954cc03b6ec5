"""Control steps per second, for pytest-benchmark; `speed.py` compares at equal validity too."""

import pytest

from lab.benchmarks.engines_timed.engines import MujocoEngine, TendonEngine

STEP = 1.0e-3  # s


@pytest.mark.parametrize("worlds", [1, 64, 1024])
@pytest.mark.parametrize("kind", [TendonEngine, MujocoEngine])
def test_control_step(
    benchmark, kind: type[TendonEngine] | type[MujocoEngine], worlds: int
) -> None:
    """50 ms of many fingers, as one graph."""
    engine = kind(worlds, STEP)
    engine.begin()
    benchmark(engine.run)
