"""Fixtures that every test may use."""

import gc
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from hypothesis import settings

# No test walks Newton's own kernels back, whose adjoints are most of what they compile. A module
# takes this when it is first imported; kernels of ours say for themselves what they need.
wp.config.enable_backward = False

from tendon_newton.cli import COLLECT_AFTER  # noqa: E402
from tendon_newton.simulation.model import assembly  # noqa: E402

# the same examples in every run, and no verdict by the clock of a busy machine
settings.register_profile("steady", derandomize=True, deadline=None, database=None)
settings.load_profile("steady")

gc.set_threshold(*COLLECT_AFTER)  # as every verb does: all libraries together are a million objects

# Most of the time went into compiling kernels that run for milliseconds: with less inlined those of
# a search compile in a quarter of the time, run a third slower, and give the same numbers.
wp.config.optimization_level = 1
wp.config.cpu_compiler_flags = "-march=native"
assembly.INLINING_FLAGS = assembly.PORTABLE_FLAGS = wp.config.cpu_compiler_flags

SEED = 20260101
SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_collection_finish() -> None:
    """Take what all modules have loaded out of every later search for dead objects."""
    gc.freeze()


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: the same numbers in every run."""
    return np.random.default_rng(SEED)


@pytest.fixture
def own_trust(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the list of trusted files out of the user's own."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.delenv("TENDON_NEWTON_TRUST", raising=False)


@pytest.fixture
def nobody_at_the_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no test wait for someone at a terminal."""
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)


@pytest.fixture
def shared() -> Path:
    """The folder of reference data beside the repository; tests that need it skip without it."""
    if not SHARED.is_dir():
        pytest.skip(f"needs the reference data in {SHARED}")
    return SHARED
