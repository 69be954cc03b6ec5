"""A calibration from the first prompt to the file, which an interruption does not undo."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from tendon_hardware.clock import Clock
from tendon_hardware.errors import InvalidCalibration
from tendon_hardware.load_cells import calibrating
from tendon_hardware.load_cells.calibration import (
    STANDARD_GRAVITY,
    CalibrationPoint,
    LoadCellCalibration,
    fit_calibration,
    load_partial,
    write_calibration,
    write_partial,
)
from tendon_hardware.load_cells.load_cell_type import LoadCell

GAINS = (128, 64, 32)


@dataclass(frozen=True, kw_only=True)
class CalibrationSession:
    """Cell, masses and file of a calibration."""

    plan: calibrating.CalibrationPlan  # Masses and their order
    out: Path  # File to write; while the calibration is not complete its points are beside it
    cell: str = "load_cell"  # Name that the operator gave the cell
    gain: int = 128  # Gain of the converter
    gravity: float = STANDARD_GRAVITY  # Gravity here [m/s^2]

    def __post_init__(self) -> None:
        if self.gain not in GAINS:
            raise InvalidCalibration(f"the gain of an HX711 is 128, 64 or 32; it is {self.gain}")
        if not 9.76 < self.gravity < 9.84:
            raise InvalidCalibration(
                f"gravity on the ground is 9.764 to 9.834 m/s^2; it is {self.gravity}"
            )
        if self.out.is_dir():
            raise InvalidCalibration(f"{self.out}: a calibration is a TOML file; it is a folder")
        if self.out.exists():
            raise InvalidCalibration(
                f"{self.out}: there is a calibration already, which logs may name; give another "
                "name, or move it away"
            )
        if not self.out.parent.is_dir():
            raise InvalidCalibration(f"{self.out}: there is no folder {self.out.parent}")

    @property
    def partial(self) -> Path:
        """File of the points that were measured so far."""
        return self.out.with_name(f"{self.out.stem}.partial.toml")

    @property
    def settings(self) -> dict[str, str | float | list[float]]:
        """Settings that must be the same for an interrupted calibration to go on."""
        return {
            "cell": self.cell,
            "gain": self.gain,
            "gravity": self.gravity,
            "masses": list(self.plan.masses),
        }

    def resume(self) -> list[CalibrationPoint]:
        """Return the points of an interrupted calibration, if there was one.

        Raises:
            InvalidCalibration: The points were measured with other settings.
        """
        if not self.partial.is_file():
            return []
        settings, points = load_partial(self.partial)
        steps = self.plan.steps[: len(points)]
        if settings != self.settings or [(p.mass, p.direction) for p in points] != list(steps):
            raise InvalidCalibration(
                f"{self.partial}: an interrupted calibration had the settings {settings}; give "
                "the same to go on, or move it away to begin anew"
            )
        return points

    def run(
        self, cell: LoadCell, clock: Clock, operator: calibrating.CalibrationOperator
    ) -> LoadCellCalibration:
        """Measure what is left of the plan, fit the line and write the file.

        Raises:
            InvalidCalibration: The points do not support a line; they are kept beside the file.
            LoadCellSilent: The cell sends nothing.
        """
        points, rate = calibrating.run_plan(
            self.plan,
            cell,
            clock,
            operator,
            self.resume(),
            keep=lambda points: write_partial(self.partial, self.settings, points),
        )
        try:
            calibration = fit_calibration(
                points,
                cell=self.cell,
                gain=self.gain,
                rate=rate,
                gravity=self.gravity,
                date=datetime.now().astimezone().isoformat("T", "seconds"),
            )
        except InvalidCalibration as error:
            ends = ("", *map("_{}".format, range(2, 1000)))  # points of others stay
            files = (self.out.with_name(f"{self.out.stem}.refused{end}.toml") for end in ends)
            refused = next(file for file in files if not file.exists())
            self.partial.replace(refused)
            raise InvalidCalibration(f"{error}; the points are in {refused}") from error
        write_calibration(self.out, calibration)
        self.partial.unlink()
        return calibration


def measure_drift(
    calibration: LoadCellCalibration,
    cell: LoadCell,
    clock: Clock,
    operator: calibrating.CalibrationOperator,
) -> float:
    """Return how far zero has moved since the calibration [N], the load taken off."""
    operator.hang(0.0, "take all load off, and wait until nothing moves")
    cell.drain()
    calibrating.await_steady(cell, clock, operator, None)
    readings = calibrating.take(cell, clock, calibrating.TARE_TIME, operator)
    return float(calibration.force(calibrating.point(readings, 0.0, "up").counts))


def points_text(calibration: LoadCellCalibration) -> list[str]:
    """Write the points out, each with its error about the line [N]."""
    lines: list[str] = []
    for p in calibration.points:
        force = calibration.gravity * p.mass
        error = float(calibration.force(p.counts)) - force
        lines.append(
            f"{p.mass:7.3f} kg {p.direction:4}  {p.counts:12.1f} counts, scatter {p.sigma:7.1f}"
            f"  {force:8.4f} N  error {error:+.4f} N"
        )
    return lines
