"""From known masses to newtons, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import InvalidCalibration, LoadCellSilent
from tendon_hardware.load_cells.calibrating import CalibrationPlan, is_steady, take
from tendon_hardware.load_cells.calibration import (
    STANDARD_GRAVITY,
    CalibrationPoint,
    Direction,
    LoadCellCalibration,
    fit_calibration,
    load_calibration,
    write_calibration,
)
from tendon_hardware.load_cells.calibration_session import CalibrationSession
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.virtual_bench import LockstepBench
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tests.hardware.load_cells.streams import StillClock, WrittenStream, lines

MASSES = (0.0, 0.2, 0.5, 1.0, 2.0)
TARE, SLOPE = 84_000.0, 2.0e-5


def points(
    *, masses: tuple[float, ...] = MASSES, slope: float = SLOPE, hysteresis: float = 0.0
) -> list[CalibrationPoint]:
    """Return the points of a cell with a known line; hysteresis in newtons."""
    up: list[tuple[float, Direction]] = [(mass, "up") for mass in masses]
    down: list[tuple[float, Direction]] = [(mass, "down") for mass in masses[-2::-1]]
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
def test_counts_are_newtons_along_the_line(force: float) -> None:
    """From the tare on, a newton takes as many counts as the slope says."""
    calibration = fit(points())
    counts = calibration.tare + force / calibration.slope
    assert float(calibration.force(counts)) == pytest.approx(force, abs=1e-9)


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
def test_points_that_support_no_line_are_refused(measured, said) -> None:
    """With the reason, and with what to do."""
    with pytest.raises(InvalidCalibration, match=said):
        fit(measured)


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
        ("gain = 128", 'gain = "high"', "gain must be a whole number; it is 'high'"),
        ('direction = "up"', 'direction = "sideways"', "direction must be one of up, down"),
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


HUNG = (0.2, 0.5, 1.0, 2.0)


class Hand:
    """Hangs what it is told, up to a step at which it gives up; may hang something else."""

    def __init__(self, *, steps: int = 99, instead: dict[float, float] | None = None) -> None:
        self.bench = LockstepBench(draw_unit("finger", 5))
        self.cell = Hx711Serial(self.bench.load_cell_stream(), clock=self.bench.clock)
        self.cell.open()
        self.asked: list[str] = []
        self._steps = steps
        self._instead = instead or {}

    def hang(self, mass: float, text: str) -> None:
        """Hang a mass [kg]."""
        if len(self.asked) == self._steps:
            raise KeyboardInterrupt
        self.asked.append(text)
        self.bench.hang_mass(self._instead.get(mass, mass))

    def show(self, counts: float, sigma: float) -> None:
        """See a finite number."""
        assert np.isfinite([counts, sigma]).all()

    def calibrate(self, session: CalibrationSession):
        """Run a session."""
        return session.run(self.cell, self.bench.clock, self)


def session(tmp_path: Path, **words) -> CalibrationSession:
    """Return a session that writes into a test's folder."""
    return CalibrationSession(
        plan=CalibrationPlan(masses=HUNG), out=tmp_path / "cell.toml", cell="A3", **words
    )


def test_a_virtual_cell_is_calibrated_to_a_thousandth(tmp_path: Path) -> None:
    """The scale of a cell that nobody has looked up, from nine measurements."""
    hand = Hand()
    calibration = hand.calibrate(session(tmp_path))
    assert load_calibration(tmp_path / "cell.toml") == calibration
    truth = hand.bench.unit.load_cell
    assert 1.0 / calibration.slope == pytest.approx(truth.counts_per_newton, rel=1e-3)
    assert calibration.residual < 0.01
    assert calibration.rate == pytest.approx(80.0, rel=0.02)
    assert [p.mass for p in calibration.points] == [0, 0.2, 0.5, 1, 2, 1, 0.5, 0.2, 0]
    tares = [p for p in calibration.points if p.mass == 0.0]
    assert min(p.duration for p in tares) > 4.9
    assert hand.asked[0].startswith("1/9: take all load off")
    assert hand.asked[4].startswith("5/9: hang 2 kg")
    assert not list(tmp_path.glob("*.partial.toml"))


def test_an_interrupted_calibration_goes_on_where_it_was(tmp_path: Path) -> None:
    """After four of nine steps somebody presses Ctrl-C; nothing measured is lost."""
    first = Hand(steps=4)
    with pytest.raises(KeyboardInterrupt):
        first.calibrate(session(tmp_path))
    assert len(session(tmp_path).resume()) == 4
    second = Hand()
    calibration = second.calibrate(session(tmp_path))
    assert len(calibration.points) == 9
    assert second.asked[0].startswith("5/9")
    with pytest.raises(InvalidCalibration, match="there is a calibration already"):
        session(tmp_path)


def test_an_interrupted_calibration_with_other_settings_is_not_mixed_in(tmp_path: Path) -> None:
    """Another gain is another cell."""
    with pytest.raises(KeyboardInterrupt):
        Hand(steps=2).calibrate(session(tmp_path))
    with pytest.raises(InvalidCalibration, match="give the same to go on"):
        session(tmp_path, gain=64).resume()


def test_a_refused_calibration_keeps_its_points(tmp_path: Path) -> None:
    """The 1 kg mass weighs 1.3 kg: named, and nothing to be measured again is lost."""
    hand = Hand(instead={1.0: 1.3})
    with pytest.raises(InvalidCalibration, match=r"without 1 kg: weigh .*cell\.refused\.toml"):
        hand.calibrate(session(tmp_path))
    first = (tmp_path / "cell.refused.toml").read_text()
    with pytest.raises(InvalidCalibration, match=r"cell\.refused_2\.toml"):
        Hand(instead={1.0: 1.4}).calibrate(session(tmp_path))
    assert (tmp_path / "cell.refused.toml").read_text() == first
    assert not (tmp_path / "cell.toml").exists()


def test_a_silent_cell_is_reported_after_three_seconds() -> None:
    """A bound on the wait, and what to look at."""
    clock = StillClock()
    cell = Hx711Serial(WrittenStream(), clock=clock)
    cell.open()
    with pytest.raises(LoadCellSilent, match=r"none came for 3 s"):
        take(cell, clock, 1.0, Hand())
    assert clock.time < 3.5


def test_a_saturated_cell_is_reported_at_once() -> None:
    """Before an operator has hung all the rest."""
    clock, stream = StillClock(), WrittenStream()
    stream.pieces = lines(0, 20, counts=0x7FFFFF)
    cell = Hx711Serial(stream, clock=clock)
    cell.open()
    with pytest.raises(InvalidCalibration, match="saturated: use a lower gain"):
        take(cell, clock, 1.0, Hand())


def test_noise_is_steady_and_drift_and_swinging_are_not(rng: np.random.Generator) -> None:
    """120 readings of 400 counts of noise, of a creeping cell, and of a swinging mass."""
    noise = 400.0 * rng.standard_normal(120)
    time = np.arange(120) / 80.0
    assert is_steady(noise.astype(int).tolist(), 400.0)
    assert not is_steady((noise + 2000.0 * time).astype(int).tolist(), 400.0)
    swing = noise + 5000.0 * np.sin(2.0 * np.pi * 1.5 * time)
    assert not is_steady(swing.astype(int).tolist(), 400.0)
    assert not is_steady([1, 2, 3], None)


def test_noise_alone_is_seldom_taken_for_drift(rng: np.random.Generator) -> None:
    """Filtered noise, as of a converter that averages four periods, over 500 windows."""
    steady = 0
    for _ in range(500):
        white = 800.0 * rng.standard_normal(123)
        filtered = np.convolve(white, (0.125, 0.375, 0.375, 0.125), mode="valid")
        steady += is_steady(filtered.astype(int).tolist(), 400.0)
    assert steady > 490


@pytest.mark.parametrize(
    ("masses", "said"),
    [
        ((0.5, 1.0), "needs 3 different masses; these are 2"),
        ((0.5, 0.5, 0.5, 1.0), "needs 3 different masses; these are 2"),
        ((0.5, 1.0, -2.0), "above 0 and at most"),
        ((0.5, 1.0, float("nan")), "above 0 and at most"),
        ((200.0, 500.0, 1000.0), "divide grams by 1000"),
    ],
)
def test_a_plan_without_an_end_is_refused(masses: tuple, said: str) -> None:
    """Before anybody hangs anything."""
    with pytest.raises(InvalidCalibration, match=said):
        CalibrationPlan(masses=masses)


@pytest.mark.parametrize("words", [{"gain": 100}, {"gravity": 1.62}])
def test_settings_that_cannot_be_are_refused(tmp_path: Path, words: dict) -> None:
    """No such gain, and not on this planet."""
    with pytest.raises(InvalidCalibration):
        session(tmp_path, **words)
