"""A bench in use: servo, load cell and clock behind one word, real or virtual."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from hardware.clock import Clock, MonotonicClock
from hardware.errors import InvalidCalibration
from hardware.load_cells import LOAD_CELLS
from hardware.load_cells.base import LoadCell
from hardware.load_cells.calibration import LoadCellCalibration
from hardware.load_cells.calibration_file import load_calibration
from hardware.load_cells.hx711_serial import Hx711Serial
from hardware.servos import SERVOS
from hardware.servos.bus import PortHandler
from hardware.servos.dynamixel_servo import DynamixelServo
from hardware.session_log import TimeBase
from hardware.virtual_bench import Faults, LockstepBench, VirtualPorts
from hardware.virtual_bench.control_table import SERVO_MODELS
from hardware.virtual_bench.plant import PlantState
from hardware.virtual_bench.process import WORD, parse_wear, parse_word
from hardware.virtual_calibration import calibrated_twin
from tendon_newton.errors import InvalidParameter, unknown_name

FILTERS = {
    80: "HX711 at 80 SPS: a step has settled after 4 conversions, 50 ms",
    20: "HX711 at 80 SPS, 50 ms to settle, then the mean of 4 readings",
    10: "HX711 at 10 SPS: a step has settled after 4 conversions, 400 ms",
}
"""What is known to happen to a reading before it comes, by its rate [Hz]."""

RETRIES = 2
"""How often an instruction is sent again: three attempts of 4 ms are one tick at 80 Hz."""
PATIENCE = 8
"""The same of a virtual bench in real time, which answers when the scheduler lets it."""

Tip = tuple[float, float]


class VirtualControls(Protocol):
    """What can be done to a virtual bench beside its two ports."""

    def set_obstacle(self, name: str) -> None:
        """Put something in the mechanism's way."""
        ...

    def set_faults(self, faults: Faults) -> None:
        """Let things go wrong."""
        ...

    def hang_mass(self, mass: float | None) -> None:
        """Hang a mass on the load cell [kg]."""
        ...

    def state(self) -> PlantState:
        """Return what is true now."""
        ...

    def plant_file(self, path: Path) -> None:
        """Write the unit's constants, which a diagnosis of its data can be compared with."""
        ...


@dataclass(frozen=True, kw_only=True)
class BenchAddress:
    """Where a bench is."""

    bench: str
    """Name under ``assets/``."""
    port: str
    """Serial port of the servo, or ``virtual[:BENCH[:SEED[:WEAR]]]``."""
    load_cell_port: str | None = None
    """Serial port of the load cell; a virtual bench brings its own."""
    load_cell: str = "hx711_serial"
    """Kind of the load cell."""
    calibration: Path | None = None
    """File that turns counts into newtons."""
    servo: str = "xc330_t288_t"
    """Kind of the servo."""
    identifier: int = 1
    """Its ID on the bus."""
    baud: int = 1_000_000
    """Rate of the bus [1/s]."""
    retries: int | None = None
    """How often an instruction to the servo is sent again; 2 in real use, which is one tick."""
    load_cell_rate: int = 20
    """Readings per second of a virtual load cell [Hz]: 80, 20 or 10; a real one has its own."""
    lockstep: bool = False
    """Whether a virtual bench runs as fast as it can instead of in real time."""

    def __post_init__(self) -> None:
        """Refuse kinds that stand in no table, and a hurry that no real bench has."""
        if self.retries is not None and not 0 <= self.retries <= 100:
            raise InvalidParameter(f"retries must be 0 to 100; they are {self.retries}")
        if self.servo not in SERVOS:
            raise unknown_name("servo", self.servo, SERVOS)
        if self.load_cell not in LOAD_CELLS:
            raise unknown_name("load cell", self.load_cell, LOAD_CELLS)
        if self.lockstep and not self.virtual:
            raise InvalidParameter(
                f"only a virtual bench can be faster than real time; --port is {self.port!r}"
            )
        if self.virtual and self.load_cell_rate not in FILTERS:
            raise InvalidParameter(
                f"a virtual load cell gives {', '.join(map(str, FILTERS))} readings per second; "
                f"{self.load_cell_rate} were asked for"
            )
        named = self.port.split(":")[1:2]
        if self.virtual and named not in ([], [""], [self.bench]):
            raise InvalidParameter(
                f"--port {self.port} names another bench than {self.bench!r}, which is recorded"
            )

    @property
    def virtual(self) -> bool:
        """The bench is not there."""
        return self.port.split(":")[0] == WORD

    @property
    def unit(self) -> int:
        """Which unit a virtual bench is."""
        words = self.port.split(":")
        return parse_word(":".join([WORD, self.bench, *words[2:]]))[1]

    @property
    def wear(self) -> str:
        """What use has done to a virtual bench."""
        return parse_wear(self.port)


@dataclass(kw_only=True)
class Bench:
    """A bench whose ports are open."""

    address: BenchAddress
    servo: DynamixelServo
    load_cell: LoadCell | None
    calibration: LoadCellCalibration | None
    """Turns counts into newtons; without one only raw counts are kept."""
    clock: Clock
    controls: VirtualControls | None = None
    """Of a virtual bench."""
    lockstep: bool = False
    """Whether time passes only while the bench is waited for."""

    def time_base(self) -> TimeBase:
        """Return stamps for a log: of the calendar, or a simulated clock's own."""
        if self.lockstep:
            return TimeBase(start=0.0, epoch=0)
        return TimeBase(start=self.clock.now(), epoch=time.time_ns())

    def tip(self) -> Tip | None:
        """Return where the finger's tip is [m], where something sees it."""
        return None if self.controls is None else self.controls.state().tip


@contextmanager
def open_bench(address: BenchAddress, tell: Callable[[str], None]) -> Iterator[Bench]:
    """Open a bench; at the end its motor is off, whatever happened.

    Args:
        address: Where it is.
        tell: Takes what the operator must know.

    Raises:
        HardwareFault: A port, the servo or the calibration is not what it must be.
    """
    with ExitStack() as stack:
        bench = virtual_bench(address, stack) if address.virtual else real_bench(address)
        bench.servo.open()
        stack.callback(close, bench, tell)
        if bench.load_cell is not None:
            bench.load_cell.open()
        yield bench


def close(bench: Bench, tell: Callable[[str], None]) -> None:
    """Switch the motor off and close the ports."""
    if bench.load_cell is not None:
        bench.load_cell.close()
    if not bench.servo.close():
        tell("The servo has not answered that its motor is off: SWITCH ITS SUPPLY OFF.")


def real_bench(address: BenchAddress) -> Bench:
    """Put together what is plugged in."""
    clock = MonotonicClock()
    cell = None
    if address.load_cell_port is not None:
        cell = LOAD_CELLS[address.load_cell](address.load_cell_port)
    elif address.calibration is not None:
        raise InvalidCalibration(
            f"{address.calibration}: a calibration needs a load cell; no port of one is given"
        )
    return Bench(
        address=address,
        servo=servo_at(address, address.port, clock),
        load_cell=cell,
        calibration=address.calibration and load_calibration(address.calibration),
        clock=clock,
    )


def virtual_bench(address: BenchAddress, stack: ExitStack) -> Bench:
    """Put together a bench that is not there; its process ends with the stack."""
    rate = address.load_cell_rate
    calibration = (
        calibrated_twin(address.bench, address.unit, rate)
        if address.calibration is None
        else load_calibration(address.calibration)
    )
    if address.lockstep:
        model = SERVO_MODELS[address.servo]
        twin = LockstepBench(
            address.bench, address.unit, load_cell_rate=rate, model=model, wear=address.wear
        )
        clock, controls = twin.clock, twin
        port, cell_port = twin.servo_port(), twin.load_cell_stream()
    else:
        controls = stack.enter_context(
            VirtualPorts(
                address.bench,
                address.unit,
                load_cell_rate=rate,
                servo=address.servo,
                wear=address.wear,
            )
        )
        clock, port, cell_port = MonotonicClock(), controls.servo_port, controls.load_cell_port
    return Bench(
        address=address,
        servo=servo_at(address, port, clock),
        load_cell=Hx711Serial(cell_port, clock=clock),
        calibration=calibration,
        clock=clock,
        controls=controls,
        lockstep=address.lockstep,
    )


def servo_at(address: BenchAddress, port: str | PortHandler, clock: Clock) -> DynamixelServo:
    """Return the driver of the bench's servo."""
    retries = address.retries
    if retries is None:
        retries = PATIENCE if address.virtual and not address.lockstep else RETRIES
    return DynamixelServo(
        SERVOS[address.servo],
        port,
        identifier=address.identifier,
        baud=address.baud,
        clock=clock,
        retries=retries,
    )
