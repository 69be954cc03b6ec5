"""Files of other programs open no others, claim no memory, and are refused in one line."""

import os
import resource
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import Dataset, load_dataset, write_dataset
from tendon_newton.data.files.text_file import kept_inside, read_text
from tendon_newton.data.files.toml_file import write_toml
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.errors import (
    InvalidAsset,
    InvalidDataset,
    InvalidOutput,
    InvalidRecording,
    TendonNewtonError,
)
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.checks import check_asset
from tests.bad_input.memory import peak_memory
from tests.bad_input.spoiling import REPLACEMENTS, replace_file
from tests.bad_input.test_spoilt_files import mapping_file, read_mapped_folder
from tests.importers.logs import dataset, recording
from tests.mechanisms.broken.flat_assets import write_changed
from tests.mechanisms.test_asset_command import MJCF

PLACES = {
    "translate = nan": ("double3 xformOp:translate = (nan, 0, 0)", "xformOp:translate"),
    "orient = inf": ("quatf xformOp:orient = (inf, 0, 0, 0)", "xformOp:orient"),
}


@pytest.mark.parametrize("include", ["/etc/passwd", "../outside.xml", "sub/../../outside.xml"])
def test_an_mjcf_file_includes_files_of_its_own_folder_alone(include: str, tmp_path: Path) -> None:
    """Absolute, upwards, and by another file that it includes; one beside it is read."""
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "outside.xml").write_text("<mujocoinclude/>")
    for name, text in (
        ("direct.xml", f'<include file="{include}"/>'),
        ("below.xml", f"<mujocoinclude><include file='{include}'/></mujocoinclude>"),
        ("nested.xml", '<include file="below.xml"/>'),
    ):
        (home / name).write_text(MJCF.replace("<worldbody>", f"{text}<worldbody>"))
        if name != "below.xml":
            with pytest.raises(InvalidAsset, match="an included file must lie in the folder of"):
                read_foreign(home / name)
    (home / "empty.xml").write_text("<mujocoinclude/>")
    own = MJCF.replace("<worldbody>", '<include file="empty.xml"/><worldbody>')
    (home / "own.xml").write_text(own)
    assert len(read_foreign(home / "own.xml").joints) == 2


@pytest.mark.parametrize("case", PLACES)
def test_a_place_that_is_no_number_is_a_finding(case: str, tmp_path: Path) -> None:
    """A check comes to its end, and loading is refused."""
    line, name = PLACES[case]
    link = 'def Xform "middle_phalanx"'
    text = write_changed(tmp_path, "finger").read_text()
    begin = text.index("xformOp:translate = (0, 0, 0)", text.index(link))
    begin = text.rindex("\n", 0, begin) + 1
    path = tmp_path / "finger.usda"
    path.write_text(text[:begin] + line + text[text.index("\n", begin) :])
    found = [f for f in check_asset(path) if f.rule == "attribute"]
    assert [name in f.message for f in found] == [True]


def test_a_text_layer_of_40_mb_is_refused_unparsed(tmp_path: Path, capsys) -> None:
    """One array took 3.9 GB; now the file's own size, and a line that says what to do."""
    path = tmp_path / "big.usda"
    path.write_text(
        '#usda 1.0\ndef Scope "a" {\n  double[] x = [' + "0.5, " * 8_000_000 + "1]\n}\n"
    )
    with peak_memory() as peak:
        assert main(["asset", "check", str(path)]) == 2
    assert peak.size < 200 << 20
    assert "Write what is large as .usdc" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ["plot", "p\udcff.mcap"],
        ["deploy", "--policy", "q\udcff.onnx", "--port", "virtual"],
        ["collect", "--notes", "a\udcffb", "--port", "virtual", "--out", "x"],
        ["simulate", "d", "--model", "m", "--out", ""],
        ["simulate", "d", "--model", "m", "--out="],
    ],
)
def test_words_that_name_nothing_are_refused_in_one_line(
    words: list[str], tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names that are not UTF-8, and an empty --out, which would be the folder one is in."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "must be UTF-8" in line or "--out must name a folder" in line
    assert not list(tmp_path.iterdir())


def test_a_name_without_end_is_told_in_short(tmp_path: Path) -> None:
    """A key of 5000 letters is cut wherever a message has it, and what is wrong stays legible."""
    mapping = mapping_file(tmp_path)
    mapping.write_text(mapping.read_text().replace("[columns.force]", f"[columns.{5000 * 'x'}]"))
    with pytest.raises(TendonNewtonError, match="known: current") as refused:
        read_mapped_folder(tmp_path / "logs" / "run_1.csv")
    assert len(str(refused.value)) < 1000


def test_an_error_of_the_system_is_told_in_words(tmp_path: Path, capsys, monkeypatch) -> None:
    """With the file if it is known, and without the system's number for it."""

    def fail(words: list[str]) -> int:
        """Fail as a full disk does."""
        raise OSError(28, "No space left on device", words[0] if words else None)

    monkeypatch.setattr("tendon_newton.cli.dispatch", fail)
    assert main(["a.csv"]) == 2
    assert capsys.readouterr().err == "error: a.csv: No space left on device\n"
    assert main([]) == 2
    assert capsys.readouterr().err == ("error: what is written or read: No space left on device\n")


@pytest.mark.parametrize("include", ["gone.xml", f"{4500 * 'x'}.xml"])
def test_an_included_file_that_is_not_there_is_told_in_short(include: str, tmp_path: Path) -> None:
    """A name may be as long as the file; its message names where it stands."""
    (tmp_path / "finger.xml").write_text(f'<mujoco><include file="{include}"/></mujoco>')
    with pytest.raises(InvalidAsset, match=r"finger\.xml: an included file must be there") as told:
        read_foreign(tmp_path / "finger.xml")
    assert len(str(told.value)) < 400


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


def test_a_full_disk_leaves_a_dataset_as_it_was(tmp_path: Path) -> None:
    """No recording is cut or of another import than the list, which stands as it stood."""
    write_dataset(tmp_path, [recording("a.csv")], [recording("b.csv")])
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    resting = recording("a.csv", force=None)
    tip = np.full((resting.sample_count, 2), 1.0 / 3.0)
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (max(map(len, before.values())), limit[1]))
    try:
        with pytest.raises(InvalidOutput, match=r"b\.csv: cannot be written: File too"):
            write_dataset(tmp_path, [resting], [replace(resting, name="b.csv", tip=tip)])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    """No error of the system without a name."""
    path = tmp_path / "none" / "model.toml"
    with pytest.raises(InvalidOutput, match=r"none/model\.toml: cannot be written: No such file"):
        write_toml(path, {"a": 1})


def test_a_link_out_of_a_folder_is_not_read(tmp_path: Path) -> None:
    """The open file's own place counts; a link to another file inside is as good as a copy."""
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret").write_text("secret")
    (home / "own").write_text("own")
    (home / "in").symlink_to(home / "own")
    (home / "out").symlink_to(tmp_path / "secret")
    with kept_inside(home):
        assert read_text(home / "in", InvalidDataset, "a text") == "own"
        with pytest.raises(InvalidDataset, match="a link that leads out of it"):
            read_text(home / "out", InvalidDataset, "a text")
    assert read_text(home / "out", InvalidDataset, "a text") == "secret"


def test_a_link_that_is_swapped_in_while_a_dataset_is_read_is_not_followed(tmp_path: Path) -> None:
    """Three hundred reads, while another program swaps file and link as fast as it can."""
    home, secret = tmp_path / "home", tmp_path / "secret.csv"
    write_dataset(home, [recording("run.csv")], [recording("test.csv")])
    own = (home / "run.csv").read_text()
    secret.write_text(own.replace("\n0.0,", "\n0.0001,", 1))
    stop = threading.Event()

    def swap() -> None:
        """Put the file and the link in turn in place."""
        while not stop.is_set():
            (home / "file").write_text(own)
            (home / "file").replace(home / "run.csv")
            os.symlink(secret, home / "link")  # noqa: PTH211 - as an attacker does
            (home / "link").replace(home / "run.csv")

    thread = threading.Thread(target=swap)
    thread.start()
    try:
        for _ in range(300):
            try:
                (run,) = load_dataset(home).train
            except TendonNewtonError:
                continue
            assert run.time[0] == 0.0
    finally:
        stop.set()
        thread.join()


def test_a_line_of_a_log_has_a_length(tmp_path: Path) -> None:
    """A log of one line of 240 MB is refused after its first block, in no more memory than that."""
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / "a.csv").write_text("t,q\n" + "1," * 120_000_000)
    (tmp_path / "mapping.toml").write_text(
        'bench = "servo"\n[columns]\nt = {column = "t"}\ntheta = {column = "q"}\n'
        'theta_d = {column = "q"}\ntheta_dot = {derive = "theta"}\n'
    )
    words = ["--mapping", str(tmp_path / "mapping.toml"), "--out", str(tmp_path / "out")]
    with peak_memory() as peak:
        assert main(["import", "mapped", str(folder), *words]) == 2
    assert peak.size < 200 << 20


@pytest.mark.parametrize("ending", ["\n", "\r", "\r\n"])
def test_long_files_of_short_lines_are_read(ending: str, tmp_path: Path) -> None:
    """Lines are counted by any ending, across blocks."""
    from tendon_newton.data.files.text_file import open_text

    path = tmp_path / "a.csv"
    path.write_text(f"0,1{ending}" * 400_000, newline="")
    with open_text(path, InvalidRecording, "a log", size_limit=1 << 28) as file:
        assert sum(1 for _ in file) == 400_000


def read_finger(path: Path) -> Recording:
    """Read a CSV file as a log of the finger."""
    return read_recording_file(path, bench="finger")


def read_whole(path: Path) -> Dataset:
    """Read a dataset that may lack a split."""
    return load_dataset(path.parent, require_train=False, require_test=False)


@pytest.mark.parametrize("kind", REPLACEMENTS)
@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("run.csv", read_finger),
        ("model.toml", load_model),
        ("dataset.toml", read_whole),
        ("train.csv", lambda path: read_whole(path.parent / "dataset.toml")),
        ("diagnosis.json", read_diagnosis),
    ],
)
def test_another_thing_in_a_files_place_is_refused(name, read, kind, tmp_path) -> None:
    """Folders, loops, pipes, nothing, empty files and files that cannot be read: one error."""
    dataset(tmp_path)
    (tmp_path / name).touch()
    replace_file(tmp_path / name, kind)
    with pytest.raises(TendonNewtonError) as refusal:
        read(tmp_path / name)
    assert (tmp_path / name).stem in str(refusal.value)
