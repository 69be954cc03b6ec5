"""The load cell during a run: its readings into the log, its silence and its faults noticed."""

from collections import deque
from collections.abc import Sequence

from tendon_hardware.benches.bench import Bench
from tendon_hardware.control.operator import Operator
from tendon_hardware.errors import SafetyStop
from tendon_hardware.load_cells.cell_doubt import DISAGREEING, LIKELY_MIN, WINDOW, CellDoubt
from tendon_hardware.load_cells.clock_fit import ReadingDates
from tendon_hardware.load_cells.load_cell_type import LoadCell, LoadCellReading
from tendon_hardware.logs.session_log import SessionLog
from tendon_hardware.safety_rules.bench_limits import SafetyLimits
from tendon_hardware.safety_rules.rules import Glance, stop_beyond
from tendon_hardware.servos.base import ServoState

SILENCE = 0.5
"""Time without a reading that is worth a word [s]: five periods of the slowest cell, 10 Hz."""


class ForceWatch:
    """Takes what the load cell sends.

    A saturated reading is none: it is logged as it came, but says no tension and breaks no silence.

    Args:
        limits: What ends a run; without them whoever takes the readings looks after that.
        spool_radius: Radius of the spools [m].
    """

    def __init__(
        self,
        bench: Bench,
        limits: SafetyLimits | None,
        operator: Operator,
        spool_radius: float,
        place: int = 0,
    ) -> None:
        drive = bench.drives[place]
        self.cell: LoadCell | None = drive.load_cell
        self.calibration = drive.calibration
        self.clock = bench.clock
        self.limits = limits
        self.operator = operator
        self.dates = ReadingDates()
        self.force: float | None = None  # Last tension [N]
        self.told: tuple[int, float] | None = None  # Counts and tension of its reading [1, N]
        # Second greatest of the latest tensions [N]: a single spike ends no run, and readings that
        # are missing in between hide nothing.
        self.agreed: float | None = None
        self.readings = 0  # Readings in the log
        self._servo = drive.servo
        self._doubt = CellDoubt(drive.calibration, drive.servo.spec, spool_radius)
        self._latest_forces: deque[float] = deque(maxlen=WINDOW)
        self._first: tuple[float, int] | None = None
        self._latest = self.clock.now()
        self._count = 0
        self._silent = self._doubted = False
        self._place = place
        self._called = "The load cell" if place == 0 else f"Load cell {place}"

    @property
    def rate(self) -> float | None:
        """Readings per second as they came [Hz]."""
        if self._first is None or self._count < 2:
            return None
        return (self._count - 1) / max(self._latest - self._first[0], 1e-9)

    @property
    def silence(self) -> float | None:
        """Time since the last reading [s], where there is a load cell."""
        return None if self.cell is None else self.clock.now() - self._latest

    @property
    def pull(self) -> float | None:
        """Tension that the motor likely makes, where the cell tells far less [N]."""
        if self.calibration is None or self.agreed is None:
            return None
        likely = self._doubt.likely
        return likely if likely > max(DISAGREEING * self.agreed, LIKELY_MIN) else None

    @property
    def fault(self) -> str | None:
        """Why the cell is not believed, where its tension would be."""
        return None if self.calibration is None else self._doubt.fault

    def move(self, state: ServoState, others: Sequence[float] = ()) -> None:
        """Take what the servo does, and where other spools are [rad].

        A tension that does not change with the servo is doubted.
        """
        if self.cell is not None:
            self._doubt.move(state, self._servo.duty, others, self._servo.voltage)

    def take(self, log: SessionLog | None) -> None:
        """Take what has come; without a log it is only watched.

        Raises:
            SafetyStop: The tension is too great, or is not or no longer known.
        """
        if self.cell is None:
            return
        readings = self.cell.drain()
        for reading, instant in zip(readings, self.dates.instants(readings), strict=True):
            self._keep(reading, instant, log)
        good = [reading.host_time for reading in readings if not reading.saturated]
        if good:
            self._hear(good[-1], log)
        else:
            self._miss(log)
        if self.limits is not None and self.fault is not None:
            raise SafetyStop(f"{self.fault}; the motor is off")
        if self.calibration is None and self._doubt.fault is not None and not self._doubted:
            self._doubted = True
            self.operator.tell(f"{self._doubt.fault}; its counts are kept as they come.")

    def _keep(self, reading: LoadCellReading, instant: float, log: SessionLog | None) -> None:
        self._count += 1
        if self._first is None:
            self._first = (reading.host_time, reading.sequence)
        if log is not None:
            log.raw_force(reading, self._place)
            self.readings += 1
        self._doubt.hear(reading)
        if self.calibration is None or reading.saturated:
            return
        self.force = float(self.calibration.force(reading.counts))
        self.told = (reading.counts, self.force)
        self._latest_forces.append(self.force)
        self._doubt.feel(self.force, reading.host_time)
        if log is not None:
            log.force(instant, reading.host_time, self.force, self._place)
        if len(self._latest_forces) < 2:
            return
        self.agreed = sorted(self._latest_forces, key=abs)[-2]
        if self.limits is not None:
            stop_beyond(self.limits, Glance(now=instant, force=self.agreed))

    def _hear(self, arrival: float, log: SessionLog | None) -> None:
        if self._silent:
            self._silent = False
            self.operator.tell(f"{self._called} is back after {arrival - self._latest:.1f} s.")
            if log is not None:
                log.event(
                    arrival,
                    "load_cell",
                    "warn",
                    "readings were missing",
                    place=self._place,
                    start=f"{self._latest - log.time_base.start:.3f}",
                    seconds=f"{arrival - self._latest:.3f}",
                )
        self._latest = arrival

    def _miss(self, log: SessionLog | None) -> None:
        now = self.clock.now()
        silence = now - self._latest
        if self.limits is not None and silence > self.limits.blindness:
            raise SafetyStop(
                f"the tension must be known while the motor runs; the load cell has been silent "
                f"for {silence:.1f} s: the motor is off; look at its plug"
            )
        if silence > SILENCE and not self._silent:
            self._silent = True
            self.operator.tell(f"{self._called} is silent; rows without force will be left out.")
            if log is not None:
                log.event(now, "load_cell", "error", "silent", place=self._place)
