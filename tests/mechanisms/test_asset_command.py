"""``tendon-newton asset``: what it prints, writes and returns."""

from pathlib import Path

import pytest
from newton import State

from tendon_newton.cli import main
from tendon_newton.mechanisms.authoring.asset_window import play
from tendon_newton.mechanisms.geometry.statics import closing_path
from tendon_newton.mechanisms.loading import load_mechanism
from tests.mechanisms.broken.test_broken_assets import write_changed


def test_check_of_a_good_asset_says_so(capsys) -> None:
    """Exit code 0 and one line."""
    assert main(["asset", "check", "finger"]) == 0
    assert "finger: no errors, no warnings" in capsys.readouterr().out


def test_an_asset_is_named_by_its_folder_too(tmp_path: Path, monkeypatch, capsys) -> None:
    """As `asset new` makes it, from inside as well; a name of ours comes first."""
    assert main(["asset", "new", "my_finger", "--folder", str(tmp_path)]) == 0
    monkeypatch.chdir(tmp_path / "my_finger")
    for word in (str(tmp_path / "my_finger"), "."):
        assert main(["asset", "check", word]) == 0
    assert "no errors" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    (tmp_path / "finger").mkdir()
    assert main(["asset", "check", "finger"]) == 0
    assert main(["asset", "check", "no_finger"]) == 2


def test_check_of_a_broken_asset_lists_rule_and_remedy(tmp_path: Path, capsys) -> None:
    """Exit code 1; the finding names its prim, its rule and what to do."""
    path = write_changed(tmp_path, "finger", ("coef = [0.008, 0.0055]", "coef = [0.008]"))
    assert main(["asset", "check", str(path)]) == 1
    printed = capsys.readouterr().out
    assert "tendon_coef" in printed
    assert "/finger/tendons/flexor" in printed
    assert "Write one moment arm per joint" in printed


def test_an_edited_asset_is_read_anew(tmp_path: Path, capsys) -> None:
    """USD keeps layers in memory; a check after an edit must see the edit."""
    path = write_changed(tmp_path, "finger", ("coef = [0.008, 0.0055]", "coef = [0.008]"))
    assert main(["asset", "check", str(path)]) == 1
    write_changed(tmp_path, "finger")
    assert main(["asset", "check", str(path)]) == 0
    assert "no errors" in capsys.readouterr().out


def test_unreadable_asset_is_misuse(tmp_path: Path, capsys) -> None:
    """Exit code 2 and one line on stderr."""
    path = tmp_path / "junk.usda"
    path.write_bytes(b"\x00\x01")
    assert main(["asset", "check", str(path)]) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_show_writes_a_picture_of_the_assets_name(tmp_path: Path, monkeypatch, capsys) -> None:
    """Without --out the picture lands in the current folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["asset", "show", "spring_weak"]) == 0
    assert (tmp_path / "spring_weak.png").read_bytes().startswith(b"\x89PNG")
    assert "spring_weak.png" in capsys.readouterr().out


@pytest.mark.parametrize("out", ["picture.svg", "no_such_folder/picture.png"])
def test_picture_that_cannot_be_written_is_misuse(out: str, tmp_path: Path, capsys) -> None:
    """Another suffix or a missing folder gives exit code 2 and names the path."""
    assert main(["asset", "show", "finger", "--out", str(tmp_path / out)]) == 2
    assert Path(out).name in capsys.readouterr().err


class FilmedViewer:
    """A viewer that keeps what it is shown and is closed after four frames."""

    def __init__(self) -> None:
        self.joint_positions: list[float] = []
        self.times: list[float] = []
        self.closed = False

    def set_model(self, model: object) -> None:
        """Take the model, as Newton's viewers do."""

    def is_running(self) -> bool:
        """Whether the window is still open."""
        return len(self.times) < 4

    def begin_frame(self, time: float) -> None:
        """Start a frame."""
        self.times.append(time)

    def log_state(self, state: State) -> None:
        """Keep the first joint's position."""
        assert state.joint_q is not None
        self.joint_positions.append(float(state.joint_q.numpy()[0]))

    def end_frame(self) -> None:
        """End a frame."""

    def close(self) -> None:
        """Shut the window."""
        self.closed = True


def test_the_window_shows_the_finger_closing() -> None:
    """Each frame has the next equilibrium, until the window is shut."""
    viewer = FilmedViewer()
    play(load_mechanism("finger"), viewer)
    path = closing_path(load_mechanism("finger")).joint_position[:4, 0]
    assert viewer.joint_positions == pytest.approx(path, rel=1e-6)  # float32
    assert viewer.times == pytest.approx([0.0, 1 / 60, 2 / 60, 3 / 60])
    assert viewer.closed
