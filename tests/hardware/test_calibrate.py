"""The verb that calibrates, as its user meets it."""

from pathlib import Path

import pytest

from tendon_hardware.load_cells.calibration import load_calibration
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tendon_newton.cli import main
from tests.bad_input.damage import refusal

MASSES = ["--masses", "0.2,0.5,1,2"]
VIRTUAL = ["--port", "virtual:finger:1", "--faster-than-real-time"]


@pytest.fixture
def calibrated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A file that the verb has made."""
    path = tmp_path / "cell.toml"
    assert main(["calibrate", *VIRTUAL, *MASSES, "--out", str(path)]) == 0
    return path


def test_the_operator_is_led_through_and_shown_what_came_of_it(tmp_path, capsys) -> None:
    """Nine steps, nine points with their errors, and the identifier that logs will name."""
    path = tmp_path / "cell.toml"
    assert main(["calibrate", *VIRTUAL, *MASSES, "--out", str(path)]) == 0
    out = capsys.readouterr().out
    assert "1/9: take all load off" in out
    assert "5/9: hang 2 kg" in out
    assert out.count("error ") == 9
    calibration = load_calibration(path)
    assert f"{path}: calibration {calibration.identifier}" in out
    assert "good up to 19.6 N" in out


def test_a_cell_on_a_serial_port_is_measured_in_real_time(calibrated, capsys) -> None:
    """What comes out of the pseudo-terminal without load is what the calibration says."""
    words = ["--port", "virtual:finger:1", "--retare", str(calibrated)]
    assert main(["calibrate", *words]) == 0
    assert "zero has moved by" in capsys.readouterr().out


def test_the_same_cell_has_not_drifted_and_another_has(calibrated, capsys) -> None:
    """Re-taring says by how much zero has moved, and which way; code 1 where that is too much."""
    assert main(["calibrate", *VIRTUAL, "--retare", str(calibrated)]) == 0
    assert "zero has moved by" in capsys.readouterr().out
    other = ["--port", "virtual:finger:2", "--faster-than-real-time"]
    assert main(["calibrate", *other, "--retare", str(calibrated)]) == 1
    out = capsys.readouterr().out
    assert "calibrate again" in out
    moved = load_calibration(calibrated).force(draw_unit("finger", 2).load_cell.offset)
    assert float(out.split("moved by ")[1].split()[0]) == pytest.approx(moved, abs=0.05)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([*VIRTUAL], "needs 3 different masses; these are 0: none"),
        ([*VIRTUAL, "--masses", "0.2,0.5"], "needs 3 different masses; these are 2"),
        ([*VIRTUAL, "--masses", "0.2,half,1"], "masses are numbers in kg"),
        ([*MASSES], "--load-cell-port must name the load cell's port"),
        ([*MASSES, "--port", "/dev/ttyUSB0"], "no servo is needed here"),
        ([*MASSES, "--load-cell-port", "/dev/no_such_port"], "/dev/no_such_port"),
        ([*MASSES, *VIRTUAL, "--gain", "100"], "the gain of an HX711 is 128, 64 or 32"),
        ([*MASSES, *VIRTUAL, "--out", "no/such/folder.toml"], "there is no folder"),
        ([*VIRTUAL, "--retare", "none.toml"], "a calibration is a TOML file"),
    ],
)
def test_misuse_is_one_line(capsys, tmp_path, monkeypatch, words, said) -> None:
    """Code 2, before anybody has hung anything."""
    monkeypatch.chdir(tmp_path)
    assert said in refusal(["calibrate", *words], capsys)


def test_a_calibration_is_not_written_over(calibrated, capsys) -> None:
    """Recordings name it."""
    before = calibrated.read_bytes()
    assert main(["calibrate", *VIRTUAL, *MASSES, "--out", str(calibrated)]) == 2
    assert "there is a calibration already" in capsys.readouterr().err
    assert calibrated.read_bytes() == before


def test_an_operator_who_is_not_there_is_missed(tmp_path, capsys, monkeypatch) -> None:
    """A real cell needs somebody at the keyboard."""
    from tendon_hardware.virtual_bench import VirtualPorts

    def end_of_input(prompt: str) -> str:
        raise EOFError(prompt)

    monkeypatch.setattr("builtins.input", end_of_input)
    with VirtualPorts("finger", 1) as ports:
        words = [*MASSES, "--load-cell-port", ports.load_cell_port, "--out", f"{tmp_path}/c.toml"]
        assert main(["calibrate", *words]) == 2
    assert "somebody must hang the masses" in capsys.readouterr().err
