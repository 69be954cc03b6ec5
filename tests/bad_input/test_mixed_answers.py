"""Answers never mix: one program writes into a folder, and files of two answers are refused."""

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.output_folder import HELD, make_folder, releasing
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.files.together import refuse_mix, together
from tendon_newton.data.model_file import write_model
from tendon_newton.diagnosis.result import write_diagnosis
from tendon_newton.errors import InvalidDataset, InvalidDiagnosis, InvalidOutput
from tests.diagnosis.test_accounts import told
from tests.held_out import small_dataset
from tests.interpreters import search_path
from tests.physics.runs import ideal_model

ROOT = Path(__file__).resolve().parents[2]
HOLDER = """
import sys, time
from pathlib import Path
from tendon_newton.data.files.output_folder import make_folder
make_folder(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(600.0)
"""


@pytest.fixture
def taken(tmp_path: Path) -> Iterator[tuple[Path, subprocess.Popen[bytes]]]:
    """A folder into which another program writes, and that program."""
    out = tmp_path / "out"
    words = [sys.executable, "-c", HOLDER, str(out)]
    environment = os.environ | {"PYTHONPATH": search_path(ROOT)}
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        yield out, holder
        holder.kill()


def test_a_folder_that_another_program_writes_is_refused(taken, tmp_path: Path, capsys) -> None:
    """By verbs of every kind, until that program has ended, however it ends."""
    out, holder = taken
    data = small_dataset(tmp_path / "data")
    simulate = ["simulate", str(data), "--model", str(data / "model.toml"), "--no-plots"]
    collect = ["collect", "--port", "virtual", "--faster-than-real-time", "--duration", "1"]
    for words in (simulate, collect, ["diagnose", str(data)], ["train-force", str(data)],
                  ["export", str(data / "model.toml"), "--to", "mujoco"],
                  ["train-policy"]):  # fmt: skip
        assert main([*words, "--out", str(out)]) == 2, words
        assert "another program is writing its results there; wait" in capsys.readouterr().err
    assert list(out.iterdir()) == []
    holder.kill()
    holder.wait()
    assert main([*simulate, "--out", str(out)]) == 0
    assert str(out) not in HELD


def test_a_folder_is_held_by_its_program_as_long_as_it_works(tmp_path: Path) -> None:
    """Taken twice by the same, not for others meanwhile, free afterwards; a shared one never."""

    def is_free() -> bool:
        file = os.open(tmp_path, os.O_RDONLY)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        finally:
            os.close(file)
        return True

    with releasing():
        make_folder(tmp_path)
        with releasing():
            make_folder(tmp_path)
        assert not is_free()
    assert is_free()
    with releasing():
        make_folder(tmp_path, shared=True)
        assert is_free()


def test_files_of_one_answer_are_placed_together_or_not_at_all(tmp_path: Path) -> None:
    """What stood there stays, to the byte, and nothing is left beside it."""
    for name in ("a", "b"):
        write_text(tmp_path / name, "old")

    def begin(folder: Path) -> None:
        with together():
            write_text(folder / "a", "new")
            with together():
                write_text(folder / "c", "new")
            assert (folder / "a").read_text() == "old"
            raise InvalidOutput("the disk is full")

    with pytest.raises(InvalidOutput, match="full"):
        begin(tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "old", "b": "old"}
    with together():
        write_text(tmp_path / "a", "new")
        write_text(tmp_path / "b", "new")
    assert {path.read_text() for path in tmp_path.iterdir()} == {"new"}


def test_the_first_error_is_the_one_that_is_told(tmp_path: Path) -> None:
    """A draft that cannot be taken away either is no news."""
    (tmp_path / "draft").mkdir()

    def fill() -> None:
        with together() as drafts:
            drafts[tmp_path / "a"] = tmp_path / "draft"
            raise InvalidOutput("the disk is full")

    with pytest.raises(InvalidOutput, match="full"):
        fill()


def test_a_folder_that_takes_no_files_is_refused_at_once(tmp_path, monkeypatch, capsys) -> None:
    """Not when an answer is there that took minutes: the disk is mounted to be read alone."""
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    data = small_dataset(tmp_path / "data")
    assert main(["diagnose", str(data), "--out", str(tmp_path / "out")]) == 2
    assert "nothing may be written to this one" in capsys.readouterr().err


def test_an_answer_that_cannot_be_written_is_told(tmp_path: Path, capsys) -> None:
    """Its verdict, at least: it took minutes."""
    data, out = small_dataset(tmp_path / "data"), tmp_path / "out"
    (out / "report.html").mkdir(parents=True)
    assert main(["diagnose", str(data), "--out", str(out), "--budget", "1s"]) == 2
    told = capsys.readouterr()
    assert "found, but not written:\nDiagnosis(" in told.out
    assert "report.html: cannot be written" in told.err


def write_answer(folder: Path, **friction: float) -> Path:
    """Write the files of a made-up answer that programs read."""
    folder.mkdir(exist_ok=True)
    model = ideal_model(viscous_friction=friction) if friction else ideal_model()
    with together():
        write_model(folder / "model.toml", model)
        write_diagnosis(folder / "diagnosis.json", replace(told(), model=model))
    return folder


@pytest.mark.parametrize("name", ["model.toml", "diagnosis.posterior.json"])
def test_an_answer_with_a_file_of_another_is_refused(name: str, tmp_path: Path, capsys) -> None:
    """By all that read it, as a killed run of an older release leaves it; a copy is not."""
    answer = write_answer(tmp_path / "answer")
    data, out = small_dataset(tmp_path / "data"), str(tmp_path / "out")
    readers = [
        ["explain", str(answer)],
        ["simulate", str(data), "--model", str(answer), "--out", out],
        ["simulate", str(data), "--model", str(answer / "model.toml"), "--out", out],
        ["export", str(answer), "--to", "mujoco", "--out", out],
        ["diagnose", str(data), "--against", str(answer), "--out", out],
        ["experiment", str(answer), "--out", f"{out}/run.csv"],
        ["train-policy", "--force", str(answer), "--out", out],
    ]
    assert main(readers[0]) == 0
    (answer / name).write_bytes((answer / name).read_bytes() + b"\n")
    capsys.readouterr()
    for words in readers:
        assert main(words) == 2, words
        assert f"diagnosis.json: {name} beside it is not of the same answer" in (
            capsys.readouterr().err
        )
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "model.toml").write_bytes((answer / "model.toml").read_bytes())
    words = ["simulate", str(data), "--model", str(tmp_path / "own" / "model.toml"), "--no-plots"]
    assert main([*words, "--out", out]) == 0


def test_what_changed_goes_into_a_folder_of_its_own(tmp_path: Path, capsys) -> None:
    """Its model would stand beside the answer of a diagnosis; a mix of both is refused too."""
    answer, data = write_answer(tmp_path / "answer"), small_dataset(tmp_path / "data")
    other = write_answer(tmp_path / "other")
    words = ["diagnose", str(data), "--against", str(answer), "--out", str(other)]
    assert main(words) == 2
    assert "holds a diagnosis; what changed goes into a folder of its own" in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize("name", ["", ".", "..", "/", "a/b", "\0", "n" * 300])
def test_hashes_of_what_is_no_name_say_nothing(name: str, tmp_path: Path) -> None:
    """An empty one ended in a traceback."""
    refuse_mix(tmp_path / "changes.json", {"files": {name: "0" * 64}}, InvalidDiagnosis)


def test_a_dataset_that_changes_while_it_is_read_is_refused(tmp_path: Path, monkeypatch) -> None:
    """What was read could be of two states."""
    data = small_dataset(tmp_path / "data")
    file = data / load_dataset(data).test[0].name
    read = load_dataset.__globals__["read_recording"]

    def slow(path: Path, entry: object) -> object:
        os.utime(file, (1.0, 1.0))
        return read(path, entry)

    monkeypatch.setitem(load_dataset.__globals__, "read_recording", slow)
    with pytest.raises(InvalidDataset, match="must stay as they are while they are read"):
        load_dataset(data)
