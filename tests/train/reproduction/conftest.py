"""A reproduction so small that a test can afford it; networks that are trained stay its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.train.reproduction.tiny import TinyBench
from train.reproduction.unit import Unit


@pytest.fixture(autouse=True)
def own_trust(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the list of trusted networks in a folder of the tests."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
    monkeypatch.delenv("TENDON_NEWTON_TRUST", raising=False)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a virtual bench with two minutes of recordings."""
    folder = tmp_path_factory.mktemp("bench") / "unit_0"
    TinyBench().record(0, folder, seed=0, most=None)
    return folder


@pytest.fixture(scope="session")
def unit(recorded: Path) -> Unit:
    """The same as the stages see it."""
    return Unit(name="unit_0", folder=recorded)
