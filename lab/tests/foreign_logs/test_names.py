"""Names inside published logs never become paths outside the folder that a user named."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.tests.foreign_logs.bam_files import bam_log
from lab.tests.foreign_logs.test_import_so101 import write_motion
from tendon_newton import plug_ins
from tests.contracts.test_names import NAMES, check_import, file_word
from tests.importers.logs import xl330_log


def so101(folder: Path, name: str) -> None:
    """Name a joint; the format separates names by white space."""
    write_motion(folder / "slow")
    text = f"Base\n{name}\n"
    (folder / "slow" / "joint_list.txt").write_bytes(text.encode("utf-8", "surrogateescape"))


def xl330(folder: Path, name: str) -> None:
    """Name the trajectory, and the file as far as a file can have the name."""
    xl330_log(folder / f"{file_word(name)}.json", trajectory=name)


def bam(folder: Path, name: str) -> None:
    """Name the same."""
    bam_log(folder / f"{file_word(name)}.json", trajectory=name)


WRITERS: dict[str, Callable[[Path, str], None]] = {"so101": so101, "xl330": xl330, "bam": bam}
"""Importer -> what writes logs of its format with a name inside."""


def test_every_importer_is_walked() -> None:
    """A new format needs a writer of hostile names here."""
    assert set(WRITERS) == set(plug_ins.added(plug_ins.IMPORTERS, ()))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", WRITERS)
def test_an_import_writes_inside_its_folder(kind, name, tmp_path, capsys) -> None:
    """It is refused in one line, or all that is written has a plain name below --out."""
    check_import(WRITERS[kind], kind, name, tmp_path, capsys)
