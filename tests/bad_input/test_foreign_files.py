"""Files of other programs open no others, claim no memory, and are refused in one line."""

from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.checks import check_asset
from tests.bad_input.memory import peak_memory
from tests.mechanisms.broken.flat_assets import write_changed
from tests.mechanisms.test_interchange import MJCF

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
