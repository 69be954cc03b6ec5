"""Fixtures that every test may use."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

# the same examples in every run, and no verdict by the clock of a busy machine
settings.register_profile("steady", derandomize=True, deadline=None, database=None)
settings.load_profile("steady")

SEED = 20260101
SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: the same numbers in every run."""
    return np.random.default_rng(SEED)


@pytest.fixture
def shared() -> Path:
    """The folder of reference data beside the repository; tests that need it skip without it."""
    if not SHARED.is_dir():
        pytest.skip(f"needs the reference data in {SHARED}")
    return SHARED
