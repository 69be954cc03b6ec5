"""The address of a bench: its ports, its servos, or the word for a virtual one."""

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from tendon_hardware.load_cells import LOAD_CELLS
from tendon_hardware.servos import find_servo
from tendon_hardware.virtual_bench.process import WORD, parse_wear, parse_word
from tendon_newton.errors import InvalidParameter, listed, look_up, shown, unknown_name

FILTERS = {
    80: "HX711 at 80 SPS: a step has settled after 4 conversions, 50 ms",
    20: "HX711 at 80 SPS, 50 ms to settle, then the mean of 4 readings",
    10: "HX711 at 10 SPS: a step has settled after 4 conversions, 400 ms",
}
"""Filters on a reading before it comes, by its rate [Hz]."""


@dataclass(frozen=True, kw_only=True)
class DriveAddress:
    """Port and ID of one servo of a bench, and the load cell in its tendon."""

    identifier: int  # ID on the bus
    # Serial port of its load cell; a virtual bench brings its own
    load_cell_port: str | None = None
    calibration: Path | None = None  # File that turns counts into newtons


@dataclass(frozen=True, kw_only=True)
class BenchAddress(DriveAddress):
    """Ports, servos and asset of a bench, real or virtual; with port and ID of its first servo."""

    bench: str  # Name under ``assets/``
    port: str  # Serial port of the servo, or ``virtual[:BENCH[:SEED[:WEAR]]]``
    # Port on which a camera's program tells where a ball is; a virtual hand brings its own
    camera_port: str | None = None
    load_cell: str = "hx711_serial"  # Kind of the load cell
    servo: str = "xc330_t288_t"  # Kind of the servo
    identifier: int = 1
    # Further servos of the same kind on the bus, in the order of the asset's tendons
    further: tuple[DriveAddress, ...] = ()
    baud: int = 1_000_000  # Rate of the bus [1/s]
    # Times that an instruction to the servo is sent again; 2 in real use, which is one tick
    retries: int | None = None
    # Readings per second of a virtual load cell [Hz]: 80, 20 or 10; a real one has its own
    load_cell_rate: int = 20
    lockstep: bool = False  # Whether a virtual bench runs as fast as it can instead of in real time

    def __post_init__(self) -> None:
        if self.retries is not None and not 0 <= self.retries <= 100:
            raise InvalidParameter(f"retries must be 0 to 100; they are {self.retries}")
        if not self.virtual and get_close_matches(self.port.split(":")[0], [WORD]):
            raise unknown_name("port", self.port, [WORD, "/dev/ttyUSB0 and the like"])
        find_servo(self.servo)
        look_up("load cell", self.load_cell, LOAD_CELLS)
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
                f"--port {self.port} names the bench {shown(named[0])}; {self.bench!r} is to be "
                f"recorded. A unit of every bench is named without one: {self.port_of_any_bench}"
            )
        identifiers = [drive.identifier for drive in self.drives]
        if len(set(identifiers)) < len(identifiers):
            raise InvalidParameter(
                f"each servo on a bus has its own ID; they are {listed(map(str, identifiers))}"
            )

    @property
    def drives(self) -> tuple[DriveAddress, ...]:
        """All servos, the first among them."""
        return (self, *self.further)

    @property
    def virtual(self) -> bool:
        """The bench is not there."""
        return self.port.split(":")[0] == WORD

    @property
    def port_of_any_bench(self) -> str:
        """The word for a virtual bench, with its unit and without the bench's name."""
        named, *rest = self.port.split(":")[1:]
        unit = [named] if named.isdecimal() and not rest else rest
        return ":".join([WORD, "", *unit]) if unit else WORD

    @property
    def unit(self) -> int:
        """Which unit a virtual bench is."""
        words = self.port.split(":")
        return parse_word(":".join([WORD, self.bench, *words[2:]]))[1]

    @property
    def wear(self) -> str:
        """Wear of a virtual bench."""
        return parse_wear(self.port)
