"""Datasets that are none through the command line: one line that names what came, and where."""

import os
from pathlib import Path
from time import process_time

import pytest

from tendon_newton.cli import VERBS, main
from tests.bad_input.damage import Damage, cell, junk, refusal, replaced, swap, text
from tests.importers.logs import dataset, model

HEADER = "t,theta,theta_dot,force\n"
ENTRY = '[[recordings]]\nfile = "train.csv"\nbench = "finger"\nsplit = "train"\n'
SPLIT = 'split = "train"'
QUICK = 5.0  # A refusal takes less of a core [s]: the widest case, a million columns, takes 2 s


def folder_of_junk(path: Path) -> None:
    """Put a folder, which is not empty, in a file's place."""
    path.mkdir()
    (path / "notes.txt").write_text("nothing")


def loop(path: Path) -> None:
    """Put a symbolic link to itself in a file's place."""
    path.symlink_to(path.name)


def entry(line: str) -> Damage:
    """Give the train recording one more key."""
    return swap("dataset.toml", SPLIT, f"{SPLIT}\n{line}")


def header(old: str, new: str) -> Damage:
    """Change the header of the train recording."""
    return swap("train.csv", old, new)


# what is done to a sound dataset -> what the line must say
DATASETS: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "a folder for dataset.toml": (replaced("dataset.toml", folder_of_junk),
        ("dataset.toml", "a dataset is a folder with dataset.toml; it is a folder")),
    "a link to a foreign text": (replaced("train.csv", lambda path: path.symlink_to("/etc/passwd")),
        ("'train.csv' is a link that leads out of it",)),
    "a mapping above": (entry('mapping = "a/../../mapping.toml"'),
        ("mapping must lie inside the dataset's folder",)),
    "TOML of 10 MB": (text("dataset.toml", "# " + 10_000_000 * "x"),
        ("dataset.toml", "at most 4000000 bytes; it has 10000002")),
    "TOML in UTF-16": (junk("dataset.toml", ENTRY.encode("utf-16")),
        ("dataset.toml", "must be UTF-8; byte 0 is not")),
    "TOML with a zero byte": (text("dataset.toml", ENTRY + "\0"),
        ("dataset.toml", f"zero byte at character {len(ENTRY)}")),
    "deep TOML": (text("dataset.toml", "a = " + 5000 * "["), ("dataset.toml", "nested too deeply")),
    "a table of 80,000 parts": (  # 61 s before there was a limit
        text("dataset.toml", "\n[" + ".".join(80_000 * ["a"]) + "]"),
        ("dataset.toml", "line 2 has a name of more than 32 parts"),
    ),
    "a quoted key of many parts": (text("dataset.toml",
        "x = {" + " . ".join(20_000 * ["'a'", '"b"']) + " = 1}"),
        ("dataset.toml", "line 1 has a name of more than 32 parts")),
    "a number of 5000 digits": (entry("load_cell_rate = " + 5000 * "9"),
        ("dataset.toml: must be TOML", "5000 digits")),
    "one table for many": (text("dataset.toml", "[recordings]\n"),
        ("recordings must be an array of tables, [[recordings]]",)),
    "numbers for tables": (text("dataset.toml", "recordings = [1, 2]\n"),
        ("recordings must be an array of tables, [[recordings]]",)),
    "an unknown table": (text("dataset.toml", "[bench]\n"), ("no key named 'bench'",)),
    "a number for a bench": (swap("dataset.toml", '"finger"', "3"),
        ("'train.csv'", "bench must be text; it is 3")),
    "a bench name of 100 kB": (swap("dataset.toml", '"finger"', f'"{100_000 * "fi!"}"'),
        ("bench must be a name", "...")),
    "an empty file name": (swap("dataset.toml", '"train.csv"', '""'),
        ("inside the dataset's folder; it is ''",)),
    "the folder for a file": (swap("dataset.toml", '"train.csv"', '"."'),
        ("inside the dataset's folder; it is '.'",)),
    "an absolute path": (swap("dataset.toml", '"train.csv"', '"/train.csv"'),
        ("inside the dataset's folder; it is '/train.csv'",)),
    "a file name with a line break": (swap("dataset.toml", '"train.csv"', r'"tr\nain.csv"'),
        ("printable characters",)),
    "a file name of 5 kB": (swap("dataset.toml", '"train.csv"', f'"{5000 * "x"}.csv"'),
        ("at most 1000 printable characters",)),
    "a component of 300 characters": (swap("dataset.toml", '"train.csv"', f'"{300 * "x"}.csv"'),
        ("cannot be read: File name too long",)),
    "the same file by two names": (text("dataset.toml",
        ENTRY + ENTRY.replace("train.csv", "./train.csv")), ("'train.csv' is listed 2 times",)),
    "no load-cell rate": (entry("load_cell_rate = 0"), ("load_cell_rate must be positive",)),
    "an endless load-cell rate": (entry("load_cell_rate = inf"),
        ("load_cell_rate must be a finite number; it is inf",)),
    "an obstacle without a word": (entry('obstacle = ""'),
        ("obstacle must be a word", "'free' where nothing touches", "it is ''")),
    "overrides as a number": (entry("bench_overrides = 3"),
        ("bench_overrides must be a table of numbers; it is 3",)),
    "a word for a mass": (entry('bench_overrides = {mass = "heavy"}'),
        ("'mass' must be a finite number", "'heavy'", "train.csv")),
    "no masses": (entry("bench_overrides = {mass = []}"), ("'mass' must have one value",)),
    "a mass in grams": (entry("bench_overrides = {mass = 490}"),
        ("'mass' must lie in [1e-09, 100] kg; it is 490",)),
    "an actuator number that is none": (entry("actuator_overrides = {gain = nan}"),
        ("actuator_overrides must be an object of finite numbers; it is {'gain': nan}",)),
    "CSV in UTF-16": (junk("train.csv", (HEADER + "0,0,0,0\n").encode("utf-16")),
        ("train.csv", "must be UTF-8; byte 0")),
    "CSV with a zero byte": (text("train.csv", HEADER + "0,0,\0,0\n"),
        ("train.csv", "zero byte at character 28")),
    "a cell of 10 MB": (cell(3, 2, 10_000_000 * "9"), ("train.csv", "a line has at most")),
    "a header of a million columns": (header("force", ",".join(f"c{n}" for n in range(1_000_000))),
        ("train.csv", "a line has at most")),
    "a header of 50,000 columns": (header("force", ",".join(f"c{n}" for n in range(50_000))),
        ("every line must have 50004 cells", "line 2 has 5")),
    "200,000 columns of one name": (header("force", ",".join(200_000 * ["c"])),
        ("column names must differ", "'c' stands 200000 times")),
    "an open quotation": (cell(2, 2, '"0.1'), ("train.csv", "line 4 has 3")),
    "tabs": (text("train.csv", "t\ttheta\ttheta_dot\tforce\n0\t0\t0\t0\n"),
        ("separated by commas",)),
    "an unnamed column": (header("force", ""), ("not be empty; one is empty",)),
    "theta with and without a number": (header("force", "theta_0"),
        ("'theta' must be one column, or one per tendon with an index; both came",)),
    "tendons with a gap": (text("train.csv",
        "t,theta_0,theta_2,theta_dot,force\n0,0,0,0,0\n1e-2,0,0,0,0\n"),
        ("'theta' must be indexed from 0 without gaps; came theta_0, theta_2",)),
    "a servo without its angle": (text("train.csv",
        "t,theta_0,theta_dot_0,theta_dot_1\n0,0,0,0\n1e-2,0,0,0\n"),
        ("column 'theta_1' is missing; theta_dot is there for 2 servos",)),
    "tendons counted from one": (header("theta,theta_dot", "theta_1,theta_dot_1"),
        ("column 'theta' is missing",)),
    "tendons in foreign digits": (header("theta_d,theta,", "theta_d,theta_١,"),
        ("column 'theta' is missing",)),
    "a column that steers the terminal":
        (header("t,", "\x1b[2J,"), ("column 't' is missing; there are \\x1b[2J",)),
    "half of a tip": (header("force", "tip_x"), ("column 'tip_z' is missing", "tip_x")),
    "enabled by half": (header("force", "enabled"), ("enabled must be 0 or 1; row 0 is 2.1",)),
    "time of a universe": (text("train.csv", HEADER + "-1e308,0,0,0\n1e308,0,0,0\n"),
        ("t must be in seconds", "inf")),
    "broken TOML": (text("dataset.toml", "[[recordings]\n"),
        ("dataset.toml: must be TOML", "line 1")),
    "no recordings": (text("dataset.toml", ""), ("[[recordings]]", "lists none")),
    "missing key": (swap("dataset.toml", 'bench = "finger"\n', ""),
        ("bench must be text; it is missing",)),
    "unknown split": (swap("dataset.toml", '"train"', '"training"'),
        ("split must be one of train, test", "'training'")),
    "no train split": (swap("dataset.toml", '"train"', '"test"'), ('split = "train"',)),
    "bag": (swap("dataset.toml", "train.csv", "run.mcap"), ("run.mcap: no such file",)),
    "negative mass": (swap("dataset.toml", 'split = "train"',
        'split = "train"\nbench_overrides = {mass = -1.0}'),
        ("'mass' must lie in", "-1", "train.csv")),
    "unknown bench number": (swap("dataset.toml", 'split = "train"',
        'split = "train"\nbench_overrides = {mas = 1.0}'),
        ("No bench override named 'mas'", "did you mean 'mass'?")),
    "header only": (text("train.csv", HEADER), ("train.csv", "it has none")),
    "one row": (text("train.csv", HEADER + "0,0,0,0\n"), ("two rows or more; it has 1",)),
    "no theta": (swap("train.csv", "theta,", "angle,"), ("column 'theta' is missing", "angle")),
    "short line": (text("train.csv", HEADER + "0,0,0,0\n1,0\n"), ("4 cells", "line 3 has 2")),
    "a word": (cell(3, 2, "abc"), ("theta must be a number; row 3 is 'abc'",)),
    "an empty cell": (cell(3, 2, ""), ("theta must be a number; row 3 is empty",)),
    "inf": (cell(4, 3, "-inf"), ("theta_dot must be finite; row 4", "-inf")),
    "time stands still": (cell(5, 0, "0.05"), ("t must strictly increase; row 5", "train.csv")),
    "a story in a column": (text("train.csv",
        f"{HEADER.strip()},note\n0,0,0,0,{2000 * 'x'}\n1e-2,0,0,0,\n"),
        ("at most 1000 characters", "'note' has 2000")),
}  # fmt: skip


@pytest.mark.parametrize("case", DATASETS)
def test_a_strange_dataset_is_refused_in_one_short_line(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every fault is named with its file, quickly, and the line never repeats megabytes."""
    monkeypatch.setitem(VERBS, "read", "tests.formats.sessions")
    damage, said = DATASETS[case]
    words = ["read", str(tmp_path), "--model", str(model(dataset(tmp_path) / "model.toml"))]
    assert main(words) == 0
    damage(tmp_path)
    began = process_time()
    line = refusal(words, capsys)
    assert process_time() - began < QUICK
    assert [words for words in said if words not in line] == []
    assert len(line) < 1500


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("nowhere", "a dataset is a folder with dataset.toml; no such folder"),
        ("dataset.toml", "dataset.toml is a file, no folder"),
        ("dataset.toml/deeper", "no such folder"),
        (5000 * "x", "it cannot be read: File name too long"),
        ("nul\0byte", "no such folder"),
    ],
)
def test_a_dataset_that_is_not_there_is_refused(path, said, tmp_path, monkeypatch, capsys) -> None:
    """What stands in the place of the folder is said."""
    monkeypatch.setitem(VERBS, "read", "tests.formats.sessions")
    dataset(tmp_path)
    line = refusal(["read", str(tmp_path / path), "--model", str(tmp_path / "model.toml")], capsys)
    assert said in line


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads everything")
def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch, capsys) -> None:
    """The operating system's refusal becomes our line."""
    monkeypatch.setitem(VERBS, "read", "tests.formats.sessions")
    folder = dataset(tmp_path / "locked")
    folder.chmod(0)
    line = refusal(["read", str(folder), "--model", str(tmp_path / "model.toml")], capsys)
    folder.chmod(0o700)
    assert "Permission denied" in line
