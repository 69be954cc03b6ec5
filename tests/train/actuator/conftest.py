"""The list of trusted networks of these tests is not the user's."""

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_trust(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep the list of trusted networks in the test's own folder."""
    folder = tmp_path / "config"
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    monkeypatch.delenv("TENDON_NEWTON_TRUST", raising=False)
    return folder
