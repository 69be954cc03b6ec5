"""From known masses to newtons, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import InvalidCalibration
from tendon_hardware.load_cells.calibration import (
    STANDARD_GRAVITY,
    CalibrationPoint,
    LoadCellCalibration,
)
from tendon_hardware.load_cells.calibration_file import load_calibration, write_calibration
from tendon_hardware.load_cells.calibration_fit import fit_calibration

MASSES = (0.0, 0.2, 0.5, 1.0, 2.0)
TARE, SLOPE = 84_000.0, 2.0e-5


def points(
    *, masses: tuple[float, ...] = MASSES, slope: float = SLOPE, hysteresis: float = 0.0
) -> list[CalibrationPoint]:
    """Return the points of a cell with a known line; hysteresis in newtons."""
    up = [(mass, "up") for mass in masses]
    down = [(mass, "down") for mass in masses[-2::-1]]
    return [
        CalibrationPoint(
            mass=mass,
            direction=direction,
            counts=TARE + (STANDARD_GRAVITY * mass + hysteresis * (direction == "down")) / slope,
            sigma=400.0,
            readings=240,
            duration=3.0,
        )
        for mass, direction in up + down
    ]


def fit(measured: list[CalibrationPoint]) -> LoadCellCalibration:
    """Fit with settings that do not matter here."""
    return fit_calibration(
        measured, cell="A3", gain=128, rate=80.0, date="2026-11-20T08:00:00+00:00"
    )


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_the_line_of_a_true_cell_is_found(slope: float) -> None:
    """Without noise, exactly, whichever way the cell is wired."""
    calibration = fit(points(slope=slope))
    assert calibration.slope == pytest.approx(slope, rel=1e-12)
    assert calibration.tare == pytest.approx(TARE, rel=1e-9)
    assert calibration.residual == pytest.approx(0.0, abs=1e-9)
    assert calibration.r_squared == pytest.approx(1.0)
    assert calibration.load_max == pytest.approx(2.0 * STANDARD_GRAVITY)
    assert calibration.noise == pytest.approx(400.0 * SLOPE)


@given(force=st.floats(-50.0, 50.0))
def test_newtons_to_counts_and_back(force: float) -> None:
    """The two conversions undo each other."""
    calibration = fit(points())
    assert float(calibration.force(calibration.counts(force))) == pytest.approx(force, abs=1e-9)


def test_the_error_of_a_noisy_cell_is_what_its_noise_gives(rng: np.random.Generator) -> None:
    """Over 200 calibrations the slope scatters as least squares says: no bias, known width."""
    slopes = []
    for _ in range(200):
        noisy = [
            replace(p, counts=p.counts + 400.0 / np.sqrt(p.readings) * rng.standard_normal())
            for p in points()
        ]
        slopes.append(fit(noisy).slope)
    load = STANDARD_GRAVITY * np.array([p.mass for p in points()])
    width = SLOPE * 400.0 / np.sqrt(240) * SLOPE / np.sqrt(((load - load.mean()) ** 2).sum())
    assert np.std(slopes) == pytest.approx(width, rel=0.25)  # 200 draws: 5 % of a deviation each
    assert np.mean(slopes) == pytest.approx(SLOPE, abs=4.0 * width / np.sqrt(200))


def test_hysteresis_is_reported_in_newtons() -> None:
    """The same mass reads 0.2 N more on the way down."""
    assert fit(points(hysteresis=0.2)).hysteresis == pytest.approx(0.2, rel=0.02)


def test_drift_of_zero_is_the_force_of_a_later_tare() -> None:
    """5000 counts more without load are 0.1 N."""
    assert fit(points()).drift(TARE + 5000.0) == pytest.approx(0.1)


def swapped() -> list[CalibrationPoint]:
    """Return points in which two masses were mixed up."""
    measured = points()
    measured[2], measured[3] = (
        replace(measured[2], counts=measured[3].counts),
        replace(measured[3], counts=measured[2].counts),
    )
    measured[5], measured[6] = (
        replace(measured[5], counts=measured[6].counts),
        replace(measured[6], counts=measured[5].counts),
    )
    return measured


def bent() -> list[CalibrationPoint]:
    """Return points of which one mass touched something."""
    return [replace(p, counts=p.counts - 4e4 * (p.mass == 1.0)) for p in points()]


@pytest.mark.parametrize(
    ("measured", "said"),
    [
        (points(masses=(0.0, 0.5, 1.0)), "needs 3 different masses; there are 2: 0.5 kg, 1 kg"),
        (points()[1:], "needs a tare on the way up"),
        (points()[:-1], "needs a tare on the way down"),
        ([p for p in points() if (p.mass, p.direction) != (0.5, "down")], "0.5 kg was hung up"),
        (swapped(), "counts must follow the masses"),
        (bent(), "without 1 kg: weigh that mass"),
        (points(hysteresis=0.5), "loading and unloading must agree within 2 %"),
    ],
)
def test_points_that_support_no_line_are_refused(
    measured: list[CalibrationPoint], said: str
) -> None:
    """With the reason, and with what to do."""
    with pytest.raises(InvalidCalibration, match=said):
        fit(measured)


def test_a_saturated_cell_is_refused() -> None:
    """The end of the range says how much it is at least."""
    with pytest.raises(InvalidCalibration, match="under 2 kg it is saturated: use a lower gain"):
        replace(points()[4], counts=float(0x7FFFFF))


def test_a_file_gives_back_its_calibration(tmp_path: Path, rng: np.random.Generator) -> None:
    """Every bit, and the identifier that logs name."""
    path = tmp_path / "cell.toml"
    calibration = fit([replace(p, counts=p.counts + rng.standard_normal()) for p in points()])
    write_calibration(path, calibration)
    assert load_calibration(path) == calibration
    assert calibration.identifier in path.read_text(encoding="utf-8")


def test_another_cell_has_another_identifier() -> None:
    """So has the same cell on another day."""
    calibration = fit(points())
    others = {
        replace(calibration, cell="B1").identifier,
        replace(calibration, gain=64).identifier,
        replace(calibration, date="2026-11-21T08:00:00+00:00").identifier,
        replace(calibration, points=calibration.points[::-1]).identifier,
    }
    assert len(others | {calibration.identifier}) == 5


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass = 0.5", "mass = 0.51", "the file was changed by hand"),
        ('cell = "A3"', 'cell = "A4"', "the file was changed by hand"),
        ("gain = 128", 'gain = "high"', "gain must be a finite number; it is 'high'"),
        ('direction = "up"', 'direction = "sideways"', "direction must be up or down"),
        ("tare =", "tara =", "no key named 'tara'"),
        ("[[points]]", "[points]", "must be TOML"),
        ("counts = ", "count = ", "no key named 'count'"),
        ("mass = 0.5", "mass = nan", "mass must be a finite number; it is nan"),
    ],
)
def test_a_changed_file_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    """Whoever mends a calibration measures again, or the logs would name something else."""
    path = tmp_path / "cell.toml"
    write_calibration(path, fit(points()))
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 2), encoding="utf-8")
    with pytest.raises(InvalidCalibration, match=said):
        load_calibration(path)


def test_a_missing_or_unfinished_file_is_named(tmp_path: Path) -> None:
    """No traceback."""
    with pytest.raises(InvalidCalibration, match="there is none"):
        load_calibration(tmp_path / "none.toml")
    (tmp_path / "empty.toml").write_text("", encoding="utf-8")
    with pytest.raises(InvalidCalibration, match="points must be a list of objects; it is missing"):
        load_calibration(tmp_path / "empty.toml")
