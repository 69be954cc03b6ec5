"""Names that others chose never become paths outside the folder that a user named."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.data.importers import IMPORTERS, MAPPED
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.errors import InvalidRecording, TendonNewtonError
from tendon_newton.exports import EXPORTS
from tendon_newton.simulation.hosts.replay import bench_of
from tests.importers.logs import recording
from tests.physics.runs import ideal_model

NAMES = ("{outside}/a", "../a", "a/b", "a\\b", "..", "", "a\nb", "a\x1b[2J", "x" * 300, "a\udcff")
"""Absolute, upwards, with separators, empty, with control characters, too long, not UTF-8."""


def lerobot(folder: Path, name: str) -> None:
    """Name the first joint."""
    from tests.importers.lerobot_files import JOINTS, lerobot_dataset

    feature = {"dtype": "float32", "shape": [3], "names": [name, *JOINTS[1:]]}
    lerobot_dataset(folder, features={"action": feature, "observation.state": feature})


def mapped(folder: Path, name: str) -> None:
    """Name the log's file, in a folder of its own."""
    path = folder / "runs" / f"{file_word(name)}.csv"
    path.parent.mkdir(parents=True)
    rows = [f"{0.01 * k},{0.1 * k},{0.1 * k}" for k in range(100)]
    path.write_text("\n".join(["t,goal,q", *rows]) + "\n")
    columns = 't = {column = "t"}\ntheta_d = {column = "goal"}\ntheta = {column = "q"}\n'
    head = 'bench = "servo"\nfiles = "*/*.csv"\n[columns]\ntheta_dot = {derive = "theta"}\n'
    (folder.parent / "mapping.toml").write_text(head + columns)


def file_word(name: str) -> str:
    """Return a name as a file on this disk can have it."""
    return name.replace("/", "\\")[:200] or " "


WRITERS: dict[str, Callable[[Path, str], None]] = {"lerobot": lerobot, MAPPED: mapped}
"""Importer -> what writes logs of its format with a name inside."""


def test_every_importer_is_walked() -> None:
    """A new format needs a writer of hostile names here."""
    assert set(WRITERS) == {*IMPORTERS, MAPPED}


@pytest.mark.parametrize("name", NAMES)
def test_an_imported_log_has_the_name_of_a_file(name: str, tmp_path: Path) -> None:
    """Whatever made the log: it may be an importer that looks at no name."""
    log = ImportedLog(recording=recording("a.csv"), conditions={}, source=tmp_path, sha256="")
    with pytest.raises(InvalidRecording, match="must be a file's name"):
        replace(log, recording=replace(log.recording, name=name))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", WRITERS)
def test_an_import_writes_inside_its_folder(kind, name, tmp_path, capsys) -> None:
    """It is refused in one line, or all that is written has a plain name below --out."""
    check_import(WRITERS[kind], kind, name, tmp_path, capsys)


def check_import(write, kind: str, name: str, folder: Path, capsys) -> None:
    """Import logs with a hostile name inside, and look at all that is written."""
    name = name.format(outside=folder / "outside")
    (folder / "outside").mkdir()
    write(folder / "logs", name)
    before = files(folder)
    out = folder / "home" / "out"
    words = ["import", kind, str(folder / "logs"), "--out", str(out)]
    words += ["--unit", "deg"] if kind == "lerobot" else []
    words += ["--mapping", str(folder / "mapping.toml")] if kind == MAPPED else []
    code = main(words)
    told = capsys.readouterr().err
    assert code == 0 or (code == 2 and told.count("\n") == 1)
    check_written(files(folder) - before, out)


@pytest.mark.parametrize("name", NAMES[:-1])  # USD keeps text that is not UTF-8 out
@pytest.mark.parametrize("target", EXPORTS)
def test_an_export_writes_inside_its_folder(target, name, tmp_path) -> None:
    """A bench's name comes from its USD file; no target makes a path of it."""
    model = ideal_model()
    mechanism = replace(bench_of("spring_weak", model), name=name.format(outside=tmp_path))
    out = tmp_path / "home" / "out"
    out.mkdir(parents=True)
    with suppress(TendonNewtonError):
        EXPORTS[target].write(out, mechanism, model)
    check_written(files(tmp_path), out)


def files(folder: Path) -> set[Path]:
    """Return all files below a folder."""
    return {path for path in folder.rglob("*") if path.is_file()}


def check_written(written: set[Path], out: Path) -> None:
    """Check that files lie in a folder, at most one level down, under names that print."""
    for path in written:
        parts = path.relative_to(out).parts
        assert len(parts) <= 2
        assert all(part.isprintable() and "\\" not in part for part in parts)
