"""A package that is installed beside ours adds verbs, log formats and export targets."""

from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.exports import Exported, find_export
from tests.bad_input.damage import refusal

SOURCE = '''"""Weigh a folder."""

from dataclasses import dataclass
from pathlib import Path

@dataclass(frozen=True, kw_only=True)
class Config:
    grams: float = 1.0

def main(config: Config) -> None:
    print(f"{config.grams} g")

def read_scale(source: Path):
    from tendon_newton.data.importers.imported import Imported, ImportedLog
    from tendon_newton.data.model_file import load_model
    from tests.importers.logs import model, recording
    logs = [
        ImportedLog(recording=recording(name), conditions={"file": name}, source=source, sha256="0")
        for name in ("a.csv", "b.csv")
    ]
    start = load_model(model(source / "start.toml"))
    return Imported(logs=tuple(logs), start_model=lambda _: start, limits={}, findings=())

def target():
    from tendon_newton.exports import Exported, ExportTarget
    return ExportTarget(coverage={}, write=lambda *_: Exported(files=(), loading="Weigh it."))

def __getattr__(name):
    if name == "TARGET":
        return target()
    raise AttributeError(name)
'''


@pytest.fixture
def plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Install a package whose entry points are given as a group's lines."""

    def install(name: str = "scales", **groups: str) -> None:
        site = tmp_path / f"site-{name}"
        (folder := site / f"{name}-1.0.dist-info").mkdir(parents=True)
        (site / f"{name}.py").write_text(SOURCE, encoding="utf-8")
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"[tendon_newton.{group}]\n{line}" for group, line in groups.items()]
        (folder / "entry_points.txt").write_text("\n".join(lines))
        monkeypatch.syspath_prepend(site)

    return install


def test_a_verb_of_a_plug_in_is_a_verb(plant, capsys) -> None:
    """Listed, with its first line, and run with its options."""
    plant(verbs="weigh = scales")
    assert main(["weigh", "--grams", "3"]) == 0
    assert main(["--help"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("3.0 g\n")
    assert any(line.split() == ["weigh", "Weigh", "a", "folder."] for line in said.splitlines())


def test_a_log_format_of_a_plug_in_is_imported(plant, tmp_path, capsys) -> None:
    """What it reads is written as our own formats are; an unknown name lists it."""
    plant("scales", importers="scale = scales:read_scale")
    words = ["import", "scale", str(tmp_path), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    assert (tmp_path / "out" / "model.toml").is_file()
    words[1] = "scal"
    assert "did you mean 'scale'" in refusal(words, capsys)


def test_an_export_target_of_a_plug_in_is_found(plant) -> None:
    """By its name, as our own are; `--to` takes it from there."""
    plant(exports="scale = scales:TARGET")
    assert find_export("scale").write() == Exported(files=(), loading="Weigh it.")


def test_what_is_not_installed_is_not_known(tmp_path, monkeypatch, capsys) -> None:
    """Where no package adds anything, our own names are listed and no others."""
    monkeypatch.setattr("tendon_newton.plug_ins.entry_points", lambda group: ())
    words = ["import", "bam", str(tmp_path), "--out", str(tmp_path / "out")]
    assert "known: lerobot, mapped" in refusal(words, capsys)
    assert "No verb named 'exam'; " in refusal(["exam"], capsys)
    assert "known: mujoco" in refusal(
        ["export", str(tmp_path), "--to", "scale", "--out", str(tmp_path / "out")], capsys
    )


@pytest.mark.parametrize(
    ("groups", "words", "said"),
    [
        ({"verbs": "weigh = nowhere"}, ["weigh"], "nowhere must be a module with main(config"),
        ({"verbs": "weigh = scales.none"}, ["weigh"], "scales.none must be a module with main"),
        ({"verbs": "demo = scales"}, ["weigh"], "package scales: 'demo' of tendon_newton.verbs"),
        ({"importers": "x = scales:gone"}, ["import", "x", "."], "package scales: scales:gone of"),
        ({"importers": "x = builtins:str"}, ["import", "x", "."], "x must give an Imported"),
        ({"exports": "x = builtins:str"}, ["export", ".", "--to", "x"], "must be an ExportTarget"),
    ],
)
def test_a_plug_in_that_cannot_be_used_is_one_line(
    plant, groups, words, said, tmp_path, capsys
) -> None:
    """Its package or its place is named; verbs of ours run beside it."""
    plant(**groups)
    out = [] if words == ["weigh"] else ["--out", str(tmp_path / "out")]
    assert said in refusal([*words, *out], capsys)
    assert main(["explain", "--help"]) == 0


def test_an_overview_shows_all_verbs_beside_a_broken_one(plant, capsys) -> None:
    """The broken one's line says why."""
    plant(verbs="weigh = nowhere")
    assert main(["--help"]) == 0
    said = capsys.readouterr().out
    assert "cannot be used: nowhere must be a module" in said
    assert "  diagnose " in said


def test_two_packages_cannot_have_one_name(plant, capsys) -> None:
    """Neither is chosen; both are named."""
    plant("scales", verbs="weigh = scales")
    plant("balance", verbs="weigh = balance")
    said = refusal(["weigh"], capsys)
    assert "package balance" in said
    assert "package scales" in said
