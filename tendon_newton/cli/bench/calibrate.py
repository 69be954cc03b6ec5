"""Calibrate a load cell with known masses, step by step, or see how far its zero has moved.

Hang the cell so that gravity pulls where the tendon will. You are told what to hang: nothing, then
each mass upwards, then downwards, then nothing. Each is measured once it is steady. The result is a
file that recordings name; raw counts are logged as well, so that a wrong calibration can be mended
later. Interrupted, it goes on where it was when it is started again with the same words.

    tendon-newton calibrate --load-cell-port /dev/ttyACM0 --masses 0.2,0.5,1,2 --out cell.toml
    tendon-newton calibrate --load-cell-port /dev/ttyACM0 --retare cell.toml
    tendon-newton calibrate --port virtual --masses 0.2,0.5,1,2 --out cell.toml
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tendon_newton.errors import InvalidParameter

if TYPE_CHECKING:
    from tendon_hardware.clock import Clock
    from tendon_hardware.load_cells.calibrating import CalibrationOperator
    from tendon_hardware.load_cells.calibration import LoadCellCalibration
    from tendon_hardware.load_cells.load_cell_type import LoadCell

EXIT_DRIFT = 1  # Exit code where zero has moved further than a recording should bear.


@dataclass(frozen=True, kw_only=True)
class Calibrate:
    """Cell, masses and result of a calibration."""

    load_cell_port: str | None = None  # Serial port of the load cell.
    port: str | None = None
    """virtual[:BENCH[:SEED]] for a bench that is not there; its masses are hung by a program."""
    faster_than_real_time: bool = False  # Let a virtual bench run as fast as it can.
    masses: str = ""
    """Known masses in kg, three or more, as in 0.2,0.5,1,2; the greatest should pull about as hard
    as the servo will, 21 N."""
    out: Path = Path("calibration.toml")  # File to write.
    retare: Path | None = None
    """Measure zero only, and say how far it has moved since this calibration was made."""
    cell: str = "load_cell"  # Your name for this cell, as on its label.
    gain: int = 128  # Gain of the converter: 128, 64 or 32.
    gravity: float = 9.80665
    """Gravity where you are, m/s^2: 9.780 at the equator, 9.832 at the poles."""


class Console:
    """An operator at the keyboard."""

    def hang(self, mass: float, text: str) -> None:
        """Ask for a mass, and wait for the return key."""
        del mass
        end_line()
        try:
            input(f"{text}, then press return ")
        except EOFError as error:
            raise InvalidParameter(
                "somebody must hang the masses and press return; the input is at its end"
            ) from error

    def show(self, counts: float, sigma: float) -> None:
        """Write the latest readings over the last ones, where somebody looks."""
        if sys.stdout.isatty():
            print(f"\r  {counts:12.0f} counts, scatter {sigma:8.1f}", end="", flush=True)


class Ghost(Console):
    """The operator of a virtual bench."""

    def __init__(self, hang_mass: Callable[[float], None]) -> None:
        self._hang_mass = hang_mass

    def hang(self, mass: float, text: str) -> None:
        """Hang a mass on the virtual load cell."""
        end_line()
        print(f"{text}  (the virtual bench does it by itself)")
        self._hang_mass(mass)


def end_line() -> None:
    """Begin a new line after readings that were written over each other."""
    if sys.stdout.isatty():
        print("\r" + " " * 48 + "\r", end="")


def main(config: Calibrate) -> None:
    """Calibrate, or look at zero."""
    from tendon_hardware.load_cells.calibrating import CalibrationPlan
    from tendon_hardware.load_cells.calibration import load_calibration
    from tendon_hardware.load_cells.calibration_session import CalibrationSession

    if config.retare is not None:
        retare(config, load_calibration(config.retare))
        return
    session = CalibrationSession(
        plan=CalibrationPlan(masses=read_masses(config.masses)),
        out=config.out,
        cell=config.cell,
        gain=config.gain,
        gravity=config.gravity,
    )
    done = len(session.resume())
    if done:
        print(f"{session.partial}: {done} of {len(session.plan.steps)} steps are done; going on")
    with opened(config) as (cell, clock, operator):
        calibration = session.run(cell, clock, operator)
    end_line()
    report(config.out, calibration)


def retare(config: Calibrate, calibration: LoadCellCalibration) -> None:
    """Measure zero, and leave with code 1 where it has moved too far."""
    from tendon_hardware.load_cells.calibration import DRIFT_LIMIT
    from tendon_hardware.load_cells.calibration_session import measure_drift

    with opened(config) as (cell, clock, operator):
        drift = measure_drift(calibration, cell, clock, operator)
    end_line()
    print(f"zero has moved by {drift:+.3f} N since {calibration.date}")
    if abs(drift) > DRIFT_LIMIT:
        print(
            f"that is more than {DRIFT_LIMIT:g} N: calibrate again, and see that the cell is warm "
            "and nothing touches it"
        )
        raise SystemExit(EXIT_DRIFT)


def read_masses(text: str) -> tuple[float, ...]:
    """Read masses [kg] separated by commas."""
    try:
        return tuple(float(word) for word in text.split(",") if word.strip())
    except ValueError as error:
        raise InvalidParameter(
            f"masses are numbers in kg, as in 0.2,0.5,1,2; they are {text!r}"
        ) from error


@contextmanager
def opened(config: Calibrate) -> Generator[tuple[LoadCell, Clock, CalibrationOperator]]:
    """Open the load cell that is named, with its clock and whoever hangs its masses."""
    from tendon_hardware.clock import MonotonicClock
    from tendon_hardware.load_cells import LOAD_CELLS

    with ExitStack() as stack:
        clock: Clock = MonotonicClock()
        if config.load_cell_port is not None:
            cell: LoadCell = LOAD_CELLS["hx711_serial"](config.load_cell_port)
            operator: CalibrationOperator = Console()
        elif config.port is not None and config.port.split(":")[0] == "virtual":
            cell, clock, operator = virtual(config, config.port, stack)
        else:
            raise InvalidParameter(
                "--load-cell-port must name the load cell's port (tendon-newton doctor lists "
                f"ports), or --port a virtual bench; --port is {config.port!r}, and no servo is "
                "needed here"
            )
        cell.open()
        stack.callback(cell.close)
        yield cell, clock, operator


def virtual(
    config: Calibrate, word: str, stack: ExitStack
) -> tuple[LoadCell, Clock, CalibrationOperator]:
    """Make the load cell of a virtual bench, in real time or as fast as it can be."""
    from tendon_hardware.clock import MonotonicClock
    from tendon_hardware.load_cells.hx711_serial import Hx711Serial
    from tendon_hardware.virtual_bench.process import lockstep_of, open_virtual

    if config.faster_than_real_time:
        bench = lockstep_of(word)
        cell = Hx711Serial(bench.load_cell_stream(), clock=bench.clock)
        return cell, bench.clock, Ghost(bench.hang_mass)
    ports = stack.enter_context(open_virtual(word))
    return Hx711Serial(ports.load_cell_port), MonotonicClock(), Ghost(ports.hang_mass)


def report(path: Path, calibration: LoadCellCalibration) -> None:
    """Print the points and what speaks for the line."""
    from tendon_hardware.load_cells.calibration_session import points_text

    print(*points_text(calibration), sep="\n")
    print(
        f"{1e6 * calibration.slope:.5g} N per million counts, zero at {calibration.tare:.0f}; "
        f"residual {calibration.residual:.4f} N, hysteresis {calibration.hysteresis:.4f} N, "
        f"R2 {calibration.r_squared:.7f}"
    )
    print(
        f"one reading scatters by {calibration.noise:.4f} N; "
        f"{calibration.rate:.1f} readings per second; good up to {calibration.load_max:.1f} N"
    )
    print(f"{path}: calibration {calibration.identifier}")
