"""Files of ours are written whole or not at all."""

import resource
from pathlib import Path

import pytest

from tendon_newton.data.files.toml_file import write_toml
from tendon_newton.errors import InvalidOutput


def test_a_full_disk_leaves_what_was_there(tmp_path: Path) -> None:
    """The error names the file, nothing is left beside it, and the old content stays."""
    path = tmp_path / "collection.toml"
    write_toml(path, {"plan": "short"})
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limit[1]))
    try:
        with pytest.raises(InvalidOutput, match=r"collection\.toml: cannot be written: File too"):
            write_toml(path, {"plan": "long" * 100})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert path.read_text(encoding="utf-8") == 'plan = "short"\n'
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    """No error of the system without a name."""
    path = tmp_path / "none" / "model.toml"
    with pytest.raises(InvalidOutput, match=r"none/model\.toml: cannot be written: No such file"):
        write_toml(path, {"a": 1})
