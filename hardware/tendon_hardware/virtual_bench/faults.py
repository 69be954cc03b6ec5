"""Faults of a virtual bench, by chance or at a set time."""

from dataclasses import dataclass, fields

from tendon_newton.errors import InvalidParameter, unknown_name

ALERT_BITS = {
    "input_voltage": 0x01,
    "overheating": 0x04,
    "encoder": 0x08,
    "electrical": 0x10,
    "overload": 0x20,
}
"""Hardware errors by word; which of them switch the torque off is register 63's business."""
EVENTS = (
    "unplug",
    "alert",
    "supply_dip",
    "reboot",
    "cell_silence",
    "cell_stuck",
    "cell_spike",
    "cell_deaf",
)
"""A load cell may send nothing, always the same, one wrong reading, or noise about what it felt
last."""
COUNTS = (-(2**23), 2**23 - 1)  # Ends of a converter's range [counts]


@dataclass(frozen=True, kw_only=True, slots=True)
class FaultEvent:
    """Planned fault of a virtual bench."""

    name: str  # Kind of the fault, one of ``EVENTS``
    start: float = 0.0  # When, on the bench's clock [s]; at once when that has passed
    duration: float = 1.0  # Length of a fault that lasts [s]
    voltage: float = 5.0  # To what the supply falls [V]; below 4.5 V the servo restarts
    alert: str = "overload"  # Which hardware error an alert latches
    # Place of the servo whose alert, restart or load cell it is; the rest strikes all
    servo: int = 0
    # Reading of a stuck cell or a spike [counts]. Unless given, a stuck cell repeats its last one,
    # and a spike reads 1.5 million too much, some 35 N.
    counts: int | None = None

    def __post_init__(self) -> None:
        if self.name not in EVENTS:
            raise unknown_name("fault event", self.name, EVENTS)
        if self.alert not in ALERT_BITS:
            raise unknown_name("hardware error", self.alert, ALERT_BITS)
        if self.servo < 0:
            raise InvalidParameter(f"A fault's servo is counted from 0; it is {self.servo}")
        if self.counts is not None and not COUNTS[0] <= self.counts <= COUNTS[1]:
            raise InvalidParameter(f"A converter has 24 bits; counts must not be {self.counts}")
        if self.duration < 0.0 or self.start < 0.0 or self.voltage < 0.0:
            raise InvalidParameter(
                f"A fault's start, duration and voltage must not be negative; {self.name} has "
                f"{self.start} s, {self.duration} s and {self.voltage} V"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class Faults:
    """Chances of the faults [1], and the planned ones."""

    dropped_replies: float = 0.0  # Answers of the servo that never come
    corrupted_replies: float = 0.0  # Answers with one bit flipped
    line_noise: float = 0.0  # Answers with a few random bytes before them
    garbled_lines: float = 0.0  # Lines of the load cell with one byte changed
    lost_lines: float = 0.0  # Lines of the load cell that never come
    extra_latency: float = 0.0  # Added to each answer [s]
    doubled_replies: float = 0.0  # Answers that come twice, as from two servos with one ID
    events: tuple[FaultEvent, ...] = ()

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name != "events" and value < 0.0:
                raise InvalidParameter(f"{each.name} must not be negative; got {value}")
            if each.name not in ("events", "extra_latency") and value > 1.0:
                raise InvalidParameter(f"{each.name} is a share of 0 to 1; got {value}")
