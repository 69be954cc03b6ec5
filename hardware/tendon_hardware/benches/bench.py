"""A bench in use: servo, load cell and clock behind one word, real or virtual."""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass

from tendon_hardware.benches.bench_address import BenchAddress, DriveAddress
from tendon_hardware.benches.virtual_calibration import calibrated_twins
from tendon_hardware.cameras.line_camera import Camera, LineCamera
from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.errors import HardwareFault, InvalidCalibration
from tendon_hardware.load_cells import LOAD_CELLS
from tendon_hardware.load_cells.calibration import LoadCellCalibration, load_calibration
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCell
from tendon_hardware.logs.session_log import TimeBase
from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.bus_servo import BusServo
from tendon_hardware.servos.serial_bus.servo_port import PortHandler, ServoPort
from tendon_hardware.virtual_bench import LockstepBench, VirtualPorts
from tendon_hardware.virtual_bench.emulation.emulations import SERVO_MODELS
from tendon_hardware.virtual_bench.physics.unit import draw_unit, has_ball, servo_count
from tendon_hardware.virtual_bench.physics.wear import worn
from tendon_newton.errors import InvalidParameter

RETRIES = 2  # Times that an instruction is sent again: three attempts of 4 ms are one tick at 80 Hz
PATIENCE = 8  # Attempts on a virtual bench in real time, which answers when the scheduler lets it


@dataclass(kw_only=True)
class BenchDrive:
    """One servo of a bench, and what measures the tension that it makes."""

    servo: BusServo
    load_cell: LoadCell | None
    calibration: LoadCellCalibration | None
    """Turns counts into newtons; without one only raw counts are kept."""


@dataclass(kw_only=True)
class Bench:
    """A bench whose ports are open."""

    address: BenchAddress
    drives: tuple[BenchDrive, ...]  # All servos on the bus, in the order of the asset's tendons
    clock: Clock
    camera: Camera | None = None  # Sees the ball in a hand; opened by who needs it
    # Controls of a virtual bench: obstacles, faults, masses; None on a real one
    controls: LockstepBench | VirtualPorts | None = None
    lockstep: bool = False  # Whether time passes only while the bench is waited for

    @property
    def servo(self) -> BusServo:
        """The first servo."""
        return self.drives[0].servo

    def time_base(self) -> TimeBase:
        """Return stamps for a log: of the calendar, or a simulated clock's own."""
        if self.lockstep:
            return TimeBase(start=0.0, epoch=0)
        return TimeBase(start=self.clock.now(), epoch=time.time_ns())


@contextmanager
def open_bench(address: BenchAddress, tell: Callable[[str], None]) -> Generator[Bench]:
    """Open a bench; at the end its motor is off, whatever happened.

    Args:
        tell: Takes what the operator must know.

    Raises:
        HardwareFault: A port, the servo or the calibration is not what it must be.
    """
    with ExitStack() as stack:
        bench = virtual_bench(address, stack) if address.virtual else real_bench(address)
        for place, drive in enumerate(bench.drives):
            drive.servo.open()
            if place == 0:
                stack.callback(close, bench, tell)
        for drive in bench.drives:
            if drive.load_cell is not None:
                drive.load_cell.open()
        yield bench


def close(bench: Bench, tell: Callable[[str], None]) -> None:
    """Switch the motors off and close the ports."""
    for drive in bench.drives:
        if drive.load_cell is not None:
            drive.load_cell.close()
    silent = [drive.servo for drive in bench.drives if not drive.servo.switched_off()]
    bench.servo.close()
    if silent:
        tell("The servo has not answered that its motor is off: SWITCH ITS SUPPLY OFF.")


def motors_off(drives: Sequence[BenchDrive], tell: Callable[[str], None]) -> None:
    """Switch motors off, as far as they can be reached; more than once does no harm."""
    for drive in drives:
        if drive.servo.torque_enabled:
            try:
                drive.servo.disable_torque()
            except HardwareFault as error:
                tell(f"THE MOTOR MAY STILL RUN, SWITCH ITS SUPPLY OFF: {error}")


def counter_facts(drives: Sequence[BenchDrive]) -> dict[str, str]:
    """Return what servos and load cells have counted, as a log's metadata names it."""
    facts: dict[str, str] = {}
    for place, drive in enumerate(drives):
        mark = f"_{place}" if place else ""
        for name, part in (("servo", drive.servo), ("load_cell", drive.load_cell)):
            if part is not None:
                counted = asdict(part.counters)
                facts |= {f"counters.{name}{mark}.{k}": str(v) for k, v in counted.items()}
    return facts


def real_bench(address: BenchAddress) -> Bench:
    """Put together what is plugged in."""
    clock = MonotonicClock()
    cells = [real_cell(drive, address.load_cell) for drive in address.drives]
    bench = bench_of(address, address.port, clock, cells, calibrations_of(address))
    if address.camera_port is not None:
        bench.camera = LineCamera(address.camera_port, clock=clock)
    return bench


def real_cell(drive: DriveAddress, kind: str) -> LoadCell | None:
    """Return the load cell in a tendon, if there is one."""
    if drive.load_cell_port is not None:
        return LOAD_CELLS[kind](drive.load_cell_port)
    if drive.calibration is not None:
        raise InvalidCalibration(
            f"{drive.calibration}: a calibration needs a load cell; no port of one is given"
        )
    return None


def calibrations_of(address: BenchAddress) -> list[LoadCellCalibration | None]:
    """Read the calibration of each load cell that has one."""
    return [each.calibration and load_calibration(each.calibration) for each in address.drives]


def bench_of(
    address: BenchAddress,
    port: str | PortHandler,
    clock: Clock,
    cells: Sequence[LoadCell | None],
    calibrations: Sequence[LoadCellCalibration | None],
) -> Bench:
    """Put servos, load cells and calibrations together, tendon by tendon."""
    rows = zip(servos_at(address, port, clock), cells, calibrations, strict=True)
    drives = tuple(
        BenchDrive(servo=servo, load_cell=cell, calibration=calibration)
        for servo, cell, calibration in rows
    )
    return Bench(address=address, drives=drives, clock=clock)


def virtual_bench(address: BenchAddress, stack: ExitStack) -> Bench:
    """Put together a bench that is not there; its process ends with the stack."""
    rate = address.load_cell_rate
    places = virtual_places(address)
    calibrations = calibrations_of(address)
    if None in calibrations:
        own = calibrated_twins(address.bench, address.unit, rate)
        calibrations = [
            own[place] if found is None else found
            for place, found in zip(places, calibrations, strict=True)
        ]
    if address.lockstep:
        unit = worn(draw_unit(address.bench, address.unit, address.servo), address.wear)
        twin = LockstepBench(unit, load_cell_rate=rate, model=SERVO_MODELS[address.servo])
        clock, controls, port = twin.clock, twin, twin.servo_port()
        camera_port = twin.camera_stream()
        cell_ports = [twin.load_cell_stream(place) for place in places]
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
        clock, port = MonotonicClock(), controls.servo_port
        camera_port = controls.camera_port
        cell_ports = [controls.load_cell_ports[place] for place in places]
    cells = [Hx711Serial(cell_port, clock=clock) for cell_port in cell_ports]
    bench = bench_of(address, port, clock, cells, calibrations)
    bench.controls, bench.lockstep = controls, address.lockstep
    if has_ball(address.bench):
        bench.camera = LineCamera(camera_port, clock=clock)
    return bench


def virtual_places(address: BenchAddress) -> list[int]:
    """Return the places of an address's servos on a virtual bench, whose IDs count from 1."""
    count = servo_count(address.bench)
    for drive in address.drives:
        if not 1 <= drive.identifier <= count:
            raise InvalidParameter(
                f"the servos of the virtual bench {address.bench!r} have the IDs 1 to {count}; "
                f"{drive.identifier} was asked for"
            )
    return [drive.identifier - 1 for drive in address.drives]


def servos_at(address: BenchAddress, port: str | PortHandler, clock: Clock) -> list[BusServo]:
    """Return the drivers of the bench's servos, which share its port."""
    retries = address.retries
    if retries is None:
        retries = PATIENCE if address.virtual and not address.lockstep else RETRIES
    shared = ServoPort(port, baud=address.baud)
    return [
        BusServo(
            SERVOS[address.servo],
            shared,
            identifier=drive.identifier,
            baud=address.baud,
            clock=clock,
            retries=retries,
        )
        for drive in address.drives
    ]
