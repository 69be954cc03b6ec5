"""A reproduction so small that a test can afford it; networks that are trained stay its own."""

import fcntl
import os
from pathlib import Path

import pytest

from lab.tests.reproduction.tiny import TinyBench
from tendon_lab.reproduction.unit import Unit


@pytest.fixture(autouse=True)
def own_trust(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the list of trusted networks in a folder of the tests."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
    monkeypatch.delenv("TENDON_NEWTON_TRUST", raising=False)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a virtual bench with two minutes of recordings, made once for all processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "bench" / "unit_0"
    folder.parent.mkdir(exist_ok=True)
    with (folder.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            TinyBench().record(0, folder, seed=0, most=None)
    return folder


@pytest.fixture(scope="session")
def unit(recorded: Path) -> Unit:
    """The same as the stages see it."""
    return Unit(name="unit_0", folder=recorded)
