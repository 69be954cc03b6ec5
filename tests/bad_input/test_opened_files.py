"""A file is opened once, and what was opened is what is checked."""

import os
import threading
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.files.text_file import kept_inside, read_text
from tendon_newton.errors import InvalidDataset, InvalidRecording, TendonNewtonError
from tests.bad_input.memory import peak_memory
from tests.importers.logs import recording


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
