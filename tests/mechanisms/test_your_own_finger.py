"""The guide to a finger of one's own, followed to the letter."""

import json
import os
import re
import shlex
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.mechanisms.asset_library import asset_names, asset_path
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.workflows.collection import radius_of
from tendon_newton.workflows.options import CollectOptions
from tests.bad_input.damage import refusal
from tests.hardware.silent_operator import SilentOperator
from tests.mechanisms.broken.test_findings import CASES

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "your_own_finger.md"
BLOCK = re.compile(r"(?:`([\w./]+)`:\n\n)?```(\w+)\n(.*?)```", re.DOTALL)
PATIENCE = 60.0  # A stranger's commands together take less [s] on one busy core; the editing is his


def blocks() -> Iterator[tuple[str, str, str]]:
    """The guide's blocks: the file that each belongs to, its language, its text."""
    for match in BLOCK.finditer(GUIDE.read_text(encoding="utf-8")):
        yield match[1] or "", match[2], match[3]


def run_line(line: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """Run one line of a shell block."""
    words = shlex.split(line.replace("$PWD", str(Path.cwd())))
    if words[0] == "export":
        monkeypatch.setenv(*words[1].split("=", 1))
        return 0
    assert words[0] == "tendon-newton"
    return main(words[1:])


def edit(path: Path, diff: str) -> None:
    """Replace, for each pair of lines of a diff, the first place where the old one stands."""
    lines = diff.splitlines()
    text = path.read_text(encoding="utf-8")
    for old, new in zip(lines[::2], lines[1::2], strict=True):
        assert (old[0], new[0]) == ("-", "+")
        assert old[1:] in text
        text = text.replace(old[1:], new[1:], 1)
    path.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("iterations", ["2", pytest.param("60", marks=pytest.mark.slow)])
def test_the_guide_works_to_the_letter(iterations, tmp_path, monkeypatch, capsys) -> None:
    """New, two numbers edited, checked, shown, simulated, a policy: every line, in a minute.

    Where a test may take its time, the policy learns as long as the guide says.
    """
    monkeypatch.chdir(tmp_path)
    seconds = 0.0
    for file, language, text in blocks():
        if language == "diff":
            edit(tmp_path / file, text)
        elif language == "sh":
            began = perf_counter()
            for written in text.splitlines():
                line = written.replace("--iterations 60", f"--iterations {iterations}")
                assert run_line(line, monkeypatch) == 0, line
            seconds += perf_counter() - began
        else:
            (tmp_path / file).parent.mkdir(exist_ok=True)
            (tmp_path / file).write_text(text, encoding="utf-8")
    assert seconds < PATIENCE
    assert "no errors, no warnings" in capsys.readouterr().out
    assert (tmp_path / "my_finger.png").read_bytes().startswith(b"\x89PNG")
    rows = np.genfromtxt(tmp_path / "simulated/step.csv", delimiter=",", names=True)
    assert 0.1 < rows["theta"][-1] < 1.5  # it closes, and the springs hold it short of the command
    curve = json.loads((tmp_path / "policy/policy.json").read_text())["curve"]
    tip_error = [row[curve["columns"].index("tip_error")] for row in curve["rows"]]
    assert len(tip_error) == int(iterations)
    assert iterations == "2" or np.mean(tip_error[-5:]) < 0.5 * np.mean(tip_error[:5])
    joint: Joint = load_mechanism("my_finger").joints[0]
    assert joint.damping == pytest.approx(1e-3, rel=1e-6)
    assert joint.rest == pytest.approx(np.radians(-10.0), rel=1e-6)


def test_the_guide_names_every_rule() -> None:
    """A finding's rule can be looked up."""
    rules = {rule for rule, *_ in CASES.values()}
    told = set(re.findall(r"`(\w+)`", GUIDE.read_text(encoding="utf-8")))
    assert rules - told == set()


def test_a_new_asset_has_the_numbers_that_it_was_given(tmp_path, monkeypatch) -> None:
    """Read back from Newton's model, in SI, they are those of the command line."""
    words = "asset new claw --joints a b --length 0.04 0.03 --mass 0.02 --moment-arm 0.01 0.006"
    assert main([*words.split(), "--folder", str(tmp_path)]) == 0
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    assert "claw" in asset_names()
    claw = load_mechanism("claw")
    assert claw.joint_names == ("a", "b")
    lengths = [joint.length for joint in claw.joints]
    assert lengths == pytest.approx([0.04, 0.03], rel=1e-6)  # float32 in the model
    assert [joint.mass for joint in claw.joints] == pytest.approx([0.02, 0.02], rel=1e-6)
    assert claw.tendons[0].moment_arm == pytest.approx([0.01, 0.006], rel=1e-6)
    for joint in claw.joints:
        assert joint.limits == pytest.approx((0.0, 1.57), rel=1e-6)
        assert joint.stiffness == pytest.approx(0.045, rel=1e-6)
        assert joint.damping == pytest.approx(5e-4, rel=1e-6)
        assert joint.stop_stiffness == pytest.approx(30.0, rel=1e-6)


def test_a_recording_has_the_spool_of_its_asset(tmp_path: Path, monkeypatch) -> None:
    """Where USD can be read; else what is taken is told. What the user gives counts first."""
    assert main(["asset", "new", "wide", "--spool-radius", "0.02", "--folder", str(tmp_path)]) == 0
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    options, operator = CollectOptions(port="virtual", out=tmp_path, bench="wide"), SilentOperator()
    assert radius_of(replace(options, spool_radius=0.01), operator) == 0.01
    assert radius_of(options, operator) == pytest.approx(0.02)
    assert operator.told == []
    monkeypatch.setitem(sys.modules, "tendon_newton.workflows.importing", None)  # a light install
    assert radius_of(replace(options, bench="finger"), operator) == 0.0125
    assert operator.told == []
    assert radius_of(options, operator) == 0.0125
    (told,) = operator.told
    assert "the spool of wide is taken to have a radius of 0.0125 m" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("my-finger", "names of assets and joints are words"),
        ("finger", "an asset's name is its own; 'finger' is"),
        ("tendon", "and not interface, geometry"),
        ("a --joints pip pip", "joints need names that differ"),
        ("a --joints tip", "'tip' is none"),
        ("a --length 0.03 0.02 0.01", "length needs one value, or one per joint: 2; it has 3"),
        ("a --length 30", "length must lie in [0.001, 0.5] m; it is 30"),
        ("a --mass nan", "mass must lie in [0.0001, 10] kg; it is nan"),
        ("a --range 90", "range must lie in [0.12, 3.142] rad; it is 90"),
        ("a --spool-radius 12.5", "spool_radius must lie in [0.001, 0.1] m; it is 12.5"),
    ],
)
def test_numbers_of_no_finger_are_refused(words, said, tmp_path, capsys) -> None:
    """The unit that most likely slipped stands in the message, and nothing is written."""
    assert said in refusal(["asset", "new", *words.split(), "--folder", str(tmp_path)], capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_new_asset_never_overwrites_one(tmp_path, capsys) -> None:
    """The second run of the same command refuses and leaves the files alone."""
    command = ["asset", "new", "claw", "--folder", str(tmp_path)]
    assert main(command) == 0
    path = tmp_path / "claw" / "physics.usda"
    path.write_text("mine")
    assert "it is there already" in refusal(command, capsys)
    assert path.read_text() == "mine"


def test_a_users_folder_may_not_shadow_an_asset(tmp_path, monkeypatch, capsys) -> None:
    """Else the nominal finger would silently be another one; a missing folder is named too."""
    (tmp_path / "finger").mkdir()
    (tmp_path / "finger/finger.usda").write_bytes(asset_path("finger").read_bytes())
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    assert "'finger' is both" in refusal(["asset", "check", "finger"], capsys)
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", f"{tmp_path}{os.pathsep}{tmp_path / 'nowhere'}")
    assert main(["asset", "check", "finger"]) == 2
