"""The load cell of a virtual bench as its operator has calibrated it once, with hung masses."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from tendon_hardware.load_cells.calibration import (
    CalibrationPoint,
    Direction,
    LoadCellCalibration,
    fit_calibration,
)
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.virtual_bench import LockstepBench
from tendon_hardware.virtual_bench.physics.unit import draw_unit

MASSES = (0.0, 0.2, 0.5, 1.0, 2.0)
"""What is hung, up and down [kg]; the greatest is about what the servo pulls, 21 N."""
REST = 1.0  # Time that a mass hangs before it is measured [s]; at 10 SPS the filter takes 0.4 s
TARE_TIME, MASS_TIME = 5.0, 2.0  # Lengths of a measurement without and with a mass [s]
DATE = "2026-01-01T00:00:00+00:00"
"""When a virtual operator did it: always, so that the same unit has the same calibration."""


@cache
def calibrated_twins(bench: str, unit: int, rate: int) -> tuple[LoadCellCalibration, ...]:
    """Calibrate all load cells of a unit, on a twin of the bench that runs before it.

    Nothing is looked up: the scale comes from readings under masses, as on a real cell, and so has
    a real one's error.

    Args:
        rate: Readings per second [Hz].
    """
    twin = LockstepBench(draw_unit(bench, unit), load_cell_rate=rate, still=True)
    cells = [
        Hx711Serial(twin.load_cell_stream(place), clock=twin.clock)
        for place in range(len(twin.servos))
    ]
    for cell in cells:
        cell.open()
    rows = [hung(twin, cells, mass, "up") for mass in MASSES]
    rows += [hung(twin, cells, mass, "down") for mass in MASSES[-2::-1]]
    names = [f"virtual {bench} {unit}{f' {place}' if place else ''}" for place in range(len(cells))]
    return tuple(
        fit_calibration(points, cell=name, gain=128, rate=float(rate), date=DATE)
        for name, points in zip(names, zip(*rows, strict=True), strict=True)
    )


def hung(
    twin: LockstepBench, cells: Sequence[Hx711Serial], mass: float, direction: Direction
) -> list[CalibrationPoint]:
    """Hang a mass [kg] on each cell, let it come to rest, and measure."""
    twin.hang_mass(mass)
    clock = twin.clock
    clock.sleep_until(clock.now() + REST)
    for cell in cells:
        cell.drain()
    duration = MASS_TIME if mass else TARE_TIME
    clock.sleep_until(clock.now() + duration)
    points: list[CalibrationPoint] = []
    for cell in cells:
        counts = np.array([reading.counts for reading in cell.drain()], dtype=np.float64)
        points.append(
            CalibrationPoint(
                mass=mass,
                direction=direction,
                counts=float(counts.mean()),
                sigma=float(counts.std()),
                readings=counts.size,
                duration=duration,
            )
        )
    return points
