"""Control steps per second, for pytest-benchmark; `speed.py` compares at equal accuracy too."""

import pytest
import warp as wp

from tests.benchmarks.engines import MujocoEngine, TendonEngine

STEP = 1.0e-3  # s


@pytest.mark.parametrize("worlds", [1, 64, 1024])
@pytest.mark.parametrize("kind", [TendonEngine, MujocoEngine])
def test_control_step(
    benchmark, kind: type[TendonEngine] | type[MujocoEngine], worlds: int
) -> None:
    """50 ms of many fingers, as one graph."""
    engine = kind(worlds, STEP)
    engine.command.fill_(1.0)
    engine.settle()
    engine.command.fill_(2.0)
    benchmark(lambda: wp.capture_launch(engine.graph))
